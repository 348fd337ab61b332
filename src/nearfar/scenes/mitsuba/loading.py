"""Read a Mitsuba scene and put a pattern grid into its projector.

Only four things of the scene are replaced: the projector's picture (by the pattern grid, constant
over each pixel: ``raw`` and ``nearest``), the film (same size and field of view, or another size;
float32; linear), its reconstruction filter (by a box, so that a camera pixel is the mean over its
own area and T has a row for each), and the sampler (by independent samples, so that photos can be
averaged). The geometry, the materials, the other lights and the integrator stay.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nearfar.arrays import AnyPath, Floats, Size
from nearfar.errors import InputError, MissingFileError, UnreadableFileError
from nearfar.scenes.mitsuba.nodes import (
    child,
    children,
    nodes,
    one,
    replace,
    replace_child,
    require_one_of_each,
)
from nearfar.scenes.mitsuba.variant import choose_variant

# Mitsuba's defaults for what a scene leaves out.
DEFAULT_FILM = Size(576, 768)
DEFAULT_SAMPLES = 4
GREY_FILMS = ("luminance", "luminance_alpha")


@dataclass(frozen=True, eq=False)
class MitsubaScene:
    """A Mitsuba scene whose projector shows a pattern grid.

    Attributes
    ----------
    name : str
        The file's name.
    projector, camera : Size
        Sizes of the pattern grid and of the photo.
    channels : int
        3 (linear red, green, blue), or 1 where the scene's film is ``luminance``.
    picture : Size or None
        Size of the projector's own picture, which patterns replace.
    white : ndarray, shape (3,), float32
        Colour of the projector's full white.
    samples : int
        The scene's own samples per camera pixel.
    integrator : str
        Name of the scene's integrator plug-in.
    settings : dict
        The integrator's parameters.
    notes : tuple of str
        What a user should know, a sentence each.
    scene : mitsuba.Scene
    """

    name: str
    projector: Size
    camera: Size
    channels: int
    picture: Size | None
    white: Floats
    samples: int
    integrator: str
    settings: dict[str, Any]
    notes: tuple[str, ...]
    scene: Any


def load_scene(
    path: AnyPath, projector: Size | None = None, camera: Size | None = None
) -> MitsubaScene:
    """Load a Mitsuba 3 scene file with one projector and one sensor.

    Parameters
    ----------
    path : str or Path
    projector : Size, optional
        Pattern grid; by default that of the projector's own picture. As in Mitsuba the emitter's
        field of view is shaped like the grid.
    camera : Size, optional
        Size of the photo; by default the film's own. The field of view along the axis that the
        sensor's ``fov`` is given for stays, the other follows the photo's shape.

    Returns
    -------
    MitsubaScene

    Raises
    ------
    MissingPackageError
        If Mitsuba is not installed.
    MissingFileError, UnreadableFileError
        If the file is not there, or is no scene that Mitsuba can load.
    InputError
        If the scene has not exactly one projector and one sensor, its film is spectral or
        cropped, its integrator is made for derivatives, or its projector has no picture to take
        a size from and none is given.
    """
    path = Path(path)
    if not path.is_file():
        raise MissingFileError(f"{path} is not there: check the name of the Mitsuba scene.")
    variant = choose_variant()
    import mitsuba as mi

    config = mi.parser.ParserConfig(variant.name)
    with _mitsuba_sentences(path):
        state = mi.parser.parse_file(config, str(path.resolve()))
    require_one_of_each(state, path)
    with _mitsuba_sentences(path):
        mi.parser.transform_all(config, state)
    light, eye = one(state, "Emitter", "projector"), one(state, "Sensor")
    picture, white = _own_picture(state, light, path)
    grid = projector or picture
    if grid is None:
        raise InputError(f"{path} has a projector without a picture: give the projector's size.")
    film, channels = _film(state, eye, camera, path)
    samples = child(state, eye, "Sampler").get("sample_count", DEFAULT_SAMPLES)
    method = next(iter(nodes(state, "Integrator")), None)
    if method is not None and method.plugin_name().startswith("prb"):
        # Without media prbvolpath brings the whole process down (Mitsuba 3.9).
        raise InputError(
            f"{path} has the integrator {method.plugin_name()}, which is made for derivatives: "
            f"use path or volpath."
        )
    notes = (*variant.notes, *_shape_notes(grid, picture or Size(1, 1), path))
    with _mitsuba_sentences(path):
        replace(light, "irradiance", _pattern_texture(np.ones(grid, np.float32), white))
        replace_child(state, eye, "Film", mi.load_dict(film))
        replace_child(state, eye, "Sampler", mi.load_dict({"type": "independent"}))
        made = mi.parser.instantiate(config, state)
    return MitsubaScene(
        name=path.name,
        projector=grid,
        camera=Size(film["height"], film["width"]),
        channels=channels,
        picture=picture,
        white=white,
        samples=int(samples),
        integrator=method.plugin_name() if method is not None else "path",
        settings=dict(method.items()) if method is not None else {},
        notes=notes,
        scene=made[0] if isinstance(made, list) else made,
    )


@contextmanager
def _mitsuba_sentences(path: Path) -> Iterator[None]:
    """Let a scene name files in its own folder, and turn Mitsuba's errors into one sentence."""
    import mitsuba as mi

    resolver = mi.file_resolver()
    resolver.prepend(str(path.resolve().parent))
    try:
        with quiet_mitsuba():
            yield
    except (RuntimeError, ValueError, TypeError, AttributeError) as error:
        reason = " ".join(str(error).split()).rstrip(".")
        raise UnreadableFileError(
            f"{path} cannot be loaded by Mitsuba ({reason}): correct the scene."
        ) from None
    finally:
        del resolver[0]


@contextmanager
def quiet_mitsuba() -> Iterator[None]:
    """Keep Mitsuba's log to errors."""
    import mitsuba as mi

    level = mi.log_level()
    mi.set_log_level(mi.LogLevel.Error)
    try:
        yield
    finally:
        mi.set_log_level(level)


def _own_picture(state: Any, light: Any, path: Path) -> tuple[Size | None, Floats]:
    """Return the size of the projector's own picture, and the colour of one without a picture."""
    import mitsuba as mi

    node = children(state, light).get("irradiance")
    if node is None:
        return None, _colour(light.get("irradiance", 1.0))
    texture = dict(node.props.items())
    if "filename" in texture:
        with _mitsuba_sentences(path):
            place = mi.file_resolver().resolve(texture["filename"])
            width, height = mi.Bitmap(str(place)).size()
        return Size(int(height), int(width)), _colour(1.0)
    return None, _colour(texture.get("value", texture.get("color", 1.0)))


def _colour(value: Any) -> Floats:
    try:
        return np.broadcast_to(np.asarray(value, dtype=np.float32), (3,)).copy()
    except (TypeError, ValueError):
        return np.ones(3, dtype=np.float32)


def _shape_notes(grid: Size, own: Size, path: Path) -> tuple[str, ...]:
    if grid.height * own.width == grid.width * own.height:
        return ()
    return (
        f"the projector of {path.name} is made for pictures shaped like {own}, and the pattern "
        f"grid of {grid} lights a field of another shape: choose a grid of the same shape to "
        f"light what the scene does.",
    )


def _film(state: Any, eye: Any, camera: Size | None, path: Path) -> tuple[dict[str, Any], int]:
    own = child(state, eye, "Film")
    kind = own.get("type", "hdrfilm")
    if kind != "hdrfilm":
        raise InputError(f"{path} has a film of type {kind}: use an hdrfilm, which is linear RGB.")
    size = Size(own.get("height", DEFAULT_FILM.height), own.get("width", DEFAULT_FILM.width))
    if min(size) < 1:
        raise InputError(f"{path} has a film of {size}, which shows nothing: make it larger.")
    crop = Size(own.get("crop_height", size.height), own.get("crop_width", size.width))
    grey = str(own.get("pixel_format", "rgb")).lower() in GREY_FILMS
    film = {
        "type": "hdrfilm",
        "width": size.width,
        "height": size.height,
        "pixel_format": "luminance" if grey else "rgb",
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }
    if crop != size:
        raise InputError(
            f"{path} crops its film to {crop} of {size}: remove the crop and choose the sensor's "
            f"field of view instead."
        )
    if camera is not None:
        film |= {"width": camera.width, "height": camera.height}
    return film, 1 if grey else 3


def _pattern_texture(pattern: Floats, white: Floats) -> Any:
    import mitsuba as mi

    return mi.load_dict(
        {
            "type": "bitmap",
            "data": pattern_tensor(pattern, white),
            "raw": True,
            "filter_type": "nearest",
            "wrap_mode": "clamp",
        }
    )


def pattern_tensor(pattern: Floats, white: Floats) -> Any:
    """Colour a pattern (Py, Px) with the projector's white, as Mitsuba's bitmap wants it."""
    import mitsuba as mi

    coloured = np.ascontiguousarray(pattern[..., None] * white, dtype=np.float32)
    return mi.TensorXf(coloured)
