"""Small Mitsuba scenes, written as text: a room's corner with one thing in it."""

WHITE = '<rgb name="irradiance" value="1 0.8 0.6"/>'
SENSOR = """
<sensor type="perspective">
  <float name="fov" value="40"/>
  <transform name="to_world">
    <lookat origin="0.3, 0, 4" target="0, 0, 0" up="0, 1, 0"/>
  </transform>
  <film type="hdrfilm">
    <integer name="width" value="16"/>
    <integer name="height" value="16"/>
    <string name="pixel_format" value="{pixels}"/>
    <rfilter type="gaussian"/>
  </film>
  <sampler type="multijitter"><integer name="sample_count" value="64"/></sampler>
</sensor>"""
PROJECTOR = """
<emitter type="projector">
  <float name="fov" value="36"/>
  <float name="scale" value="20"/>
  <transform name="to_world">
    <lookat origin="-0.3, 0.1, 4" target="0, 0, 0" up="0, 1, 0"/>
  </transform>
  {picture}
</emitter>"""
WALLS = """
<shape type="rectangle">
  <transform name="to_world"><scale value="1.5"/><translate z="-1"/></transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.8"/></bsdf>
</shape>
<shape type="rectangle">
  <transform name="to_world">
    <scale value="1.5"/><rotate y="1" angle="90"/><translate x="-1"/>
  </transform>
  <bsdf type="diffuse"><rgb name="reflectance" value="0.7 0.2 0.2"/></bsdf>
</shape>"""
LAMP = """
<shape type="rectangle">
  <transform name="to_world">
    <scale value="0.3"/><rotate x="1" angle="90"/><translate y="1.2"/>
  </transform>
  <emitter type="area"><rgb name="radiance" value="0.5"/></emitter>
</shape>
<emitter type="point">
  <point name="position" x="1" y="1" z="2"/><rgb name="intensity" value="0.3"/>
</emitter>"""


def ball(x: float, y: float, z: float, inside: str, radius: float = 0.5) -> str:
    return (
        f'<shape type="sphere"><float name="radius" value="{radius}"/>'
        f'<point name="center" x="{x}" y="{y}" z="{z}"/>{inside}</shape>'
    )


def panel(bsdf: str) -> str:
    return (
        '<shape type="rectangle"><transform name="to_world"><scale value="0.8"/>'
        f'<translate z="0.8"/></transform>{bsdf}</shape>'
    )


def medium(kind: str, extinction: str, boundary: str = '<bsdf type="null"/>') -> str:
    return (
        f'{boundary}<medium name="interior" type="{kind}">'
        f'<rgb name="albedo" value="0.9 0.8 0.6"/>{extinction}'
        '<float name="scale" value="8"/>'
        '<phase type="hg"><float name="g" value="0.4"/></phase></medium>'
    )


MASK = (
    '<bsdf type="mask"><float name="opacity" value="0.4"/>'
    '<bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf>'
)
GLOSSY = (
    ball(0.4, -0.4, 0, '<bsdf type="roughconductor"><float name="alpha" value="0.2"/></bsdf>')
    + ball(-0.4, 0.4, 0, '<bsdf type="roughplastic"><float name="alpha" value="0.15"/></bsdf>')
    + ball(0.6, 0.6, 0.2, '<bsdf type="dielectric"/>', 0.3)
)
EVEN = ball(0.2, 0, 0, medium("homogeneous", '<rgb name="sigma_t" value="0.25 0.5 0.75"/>'))
GRID = ball(
    0.2,
    0,
    0,
    medium(
        "heterogeneous",
        '<volume name="sigma_t" type="gridvolume"><string name="filename" value="smoke.vol"/>'
        '<transform name="to_world"><translate x="-0.3" y="-0.5" z="-0.5"/></transform></volume>',
    ),
)


def integrator(kind: str, depth: int = 6, roulette: int = 5) -> str:
    return (
        f'<integrator type="{kind}"><integer name="max_depth" value="{depth}"/>'
        f'<integer name="rr_depth" value="{roulette}"/></integrator>'
    )


def scene(
    body: str = "",
    *,
    method: str | None = None,
    picture: str = WHITE,
    pixels: str = "rgb",
    sensor: str = SENSOR,
    projector: str = PROJECTOR,
) -> str:
    method = integrator("path") if method is None else method
    return (
        f'<scene version="3.0.0">{method}{sensor.format(pixels=pixels)}'
        f"{projector.format(picture=picture)}{WALLS}{body}</scene>"
    )
