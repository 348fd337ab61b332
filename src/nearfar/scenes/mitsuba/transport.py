"""The whole transport of a Mitsuba scene in one pass, without a rendering per projector pixel.

Index convention: c is a camera pixel and p a projector pixel, both flattened row by row; a block
of T is (camera pixels of the block, P, 3).
"""

from collections.abc import Callable
from math import ceil
from typing import Any

import numpy as np

from nearfar.arrays import Floats, Size, blocks
from nearfar.errors import InputError
from nearfar.scenes.mitsuba.loading import MitsubaScene, pattern_tensor, quiet_mitsuba
from nearfar.scenes.mitsuba.photos import SAMPLES_AT_ONCE, projector_of, require_samples
from nearfar.transport.exact import ExactTransport

# Samples per camera pixel where none are given.
DEFAULT_SAMPLES = 4096
# Bytes of a block of T while it is summed.
BLOCK_BYTES = 256 * 2**20
# Weights by which Mitsuba turns linear RGB into the value of a grey film (Rec. 709 luminance).
LUMINANCE_WEIGHTS = np.array([0.212671, 0.715160, 0.072169])

# Integrators whose paths can be followed, with their default longest path and start of roulette.
INTEGRATORS = {
    "path": (-1, 5),
    "direct": (2, 5),
    "volpath": (-1, 5),
    "volpathmis": (-1, 5),
}


def render_transport(
    loaded: MitsubaScene,
    samples: int = DEFAULT_SAMPLES,
    seed: int = 0,
    *,
    progress: Callable[[str, float], None] | None = None,
) -> ExactTransport:
    """Estimate T of a Mitsuba scene by path tracing, all projector pixels at once.

    The estimate is unbiased: the mean of ``T @ l`` is what
    `RenderedWorld` renders under ``l`` less what it renders under black. Lights other than the
    projector take no part, since they are ambient light.

    Parameters
    ----------
    loaded : MitsubaScene
    samples : int
        Paths per camera pixel; a few more where they are split into passes.
    seed : int
        The vectorised variants add in any order, so equal seeds agree up to rounding.
    progress : callable, optional
        Called with what is being done and the share done.

    Returns
    -------
    ExactTransport
        In the scene's own units, components together. A pass is summed in float32 by the
        vectorised variants, passes in float64; the result is float32.

    Raises
    ------
    InputError
        If the scene's integrator is not one whose paths can be followed, or `samples` is not
        positive.
    """
    report = progress or (lambda _what, _share: None)
    require_samples(samples)
    rules = _rules(loaded)
    camera, projector = loaded.camera, loaded.projector
    far = np.empty((loaded.channels, camera.pixels, projector.pixels), dtype=np.float32)
    length = max(1, BLOCK_BYTES // (projector.pixels * 3 * 8))
    with quiet_mitsuba():
        _light_fully(loaded)
        for number, block in enumerate(blocks(camera.pixels, length)):
            rows = block.stop - block.start
            passes = ceil(samples * rows / SAMPLES_AT_ONCE)
            each = ceil(samples / passes)
            total: Floats = np.zeros((rows, projector.pixels, 3), dtype=np.float64)
            seeds = np.random.SeedSequence([seed, number]).generate_state(passes)
            for i, start in enumerate(seeds):
                total += _tally(loaded, rules, block, each, int(start))
                report("tracing paths", (block.start + rows * (i + 1) / passes) / camera.pixels)
            total /= passes * each
            far[:, block] = _film_values(total, loaded.channels)
    return ExactTransport(projector, camera, (), (), far, loaded.name)


def _rules(loaded: MitsubaScene) -> Any:
    from nearfar.scenes.mitsuba.paths import UNLIMITED_DEPTH, Rules

    if loaded.integrator not in INTEGRATORS:
        raise InputError(
            f"{loaded.name} has the integrator {loaded.integrator}, whose paths cannot be "
            f"followed: use one of {', '.join(INTEGRATORS)}."
        )
    longest, roulette = INTEGRATORS[loaded.integrator]
    volumetric = "volpath" in loaded.integrator
    longest = int(loaded.settings.get("max_depth", longest))
    return Rules(
        volumetric=volumetric,
        max_depth=UNLIMITED_DEPTH if longest < 0 else longest,
        rr_depth=int(loaded.settings.get("rr_depth", roulette)) + volumetric,
        hide_emitters=bool(loaded.settings.get("hide_emitters", False)),
    )


def _light_fully(loaded: MitsubaScene) -> None:
    """Show full white, so that connections carry the light of each projector pixel."""
    import mitsuba as mi

    parameters = mi.traverse(projector_of(loaded.scene))
    white = np.ones(loaded.projector, dtype=np.float32)
    parameters["irradiance.data"] = pattern_tensor(white, loaded.white)
    parameters.update()


def _film_values(total: Floats, channels: int) -> Floats:
    """Turn sums (rows, P, 3) into channels: (channels, rows, P)."""
    values = total if channels == 3 else (total @ LUMINANCE_WEIGHTS)[..., None]
    return np.moveaxis(values, 2, 0)


class _ScalarTally:
    """Sums of connections of single paths."""

    def __init__(self, rows: int, projector: Size) -> None:
        self._projector = projector
        self.sums: Floats = np.zeros((rows, projector.pixels, 3), dtype=np.float64)

    def add(self, row: int, uv: Any, light: Any, active: bool) -> None:
        """Add a connection's light under the projector pixel at uv."""
        if active:
            height, width = self._projector
            y, x = min(int(uv.y * height), height - 1), min(int(uv.x * width), width - 1)
            self.sums[row, y * width + x] += np.asarray(light)


class _VectorTally:
    """Sums of connections of many paths, in float32."""

    def __init__(self, rows: int, projector: Size) -> None:
        import drjit as dr
        import mitsuba as mi

        self._shape = (rows, projector.pixels, 3)
        self._projector = projector
        self._sums = dr.zeros(mi.Float, rows * projector.pixels * 3)

    def add(self, row: Any, uv: Any, light: Any, active: Any) -> None:
        """Add each connection's light under its projector pixel."""
        import drjit as dr
        import mitsuba as mi

        height, width = self._projector
        y = dr.clip(mi.UInt32(uv.y * height), 0, height - 1)
        x = dr.clip(mi.UInt32(uv.x * width), 0, width - 1)
        place = 3 * (row * self._projector.pixels + y * width + x)
        for i in range(3):
            # No copy of T per thread, which other modes would make.
            dr.scatter_reduce(
                dr.ReduceOp.Add, self._sums, light[i], place + i, active, dr.ReduceMode.Direct
            )

    @property
    def sums(self) -> Floats:
        """The sums so far, (rows, P, 3)."""
        return np.asarray(self._sums).reshape(self._shape)


def _tally(loaded: MitsubaScene, rules: Any, block: slice, each: int, seed: int) -> Floats:
    """Follow `each` paths from every camera pixel of a block: sums, (rows, P, 3)."""
    import drjit as dr
    import mitsuba as mi

    rows = block.stop - block.start
    sampler = mi.load_dict({"type": "independent"})
    if _is_scalar():
        sampler.seed(seed)
        scalar = _ScalarTally(rows, loaded.projector)
        for row in range(rows):
            for _ in range(each):
                _trace(loaded, rules, sampler, row, block.start + row, scalar)
        return scalar.sums
    sampler.seed(seed, rows * each)
    vector = _VectorTally(rows, loaded.projector)
    # Numbers that differ from call to call must not be compiled into the kernel.
    row = dr.arange(mi.UInt32, rows * each) // dr.opaque(mi.UInt32, each)
    _trace(loaded, rules, sampler, row, row + dr.opaque(mi.UInt32, block.start), vector)
    return vector.sums


def _is_scalar() -> bool:
    import mitsuba as mi

    return bool(mi.variant().startswith("scalar"))


def _trace(
    loaded: MitsubaScene, rules: Any, sampler: Any, row: Any, pixel: Any, tally: Any
) -> None:
    """Send paths from camera pixels as Mitsuba's integrators do, and follow them."""
    import mitsuba as mi

    from nearfar.scenes.mitsuba.paths import follow

    sensor = loaded.scene.sensors()[0]
    height, width = loaded.camera
    corner = mi.Vector2f(mi.Float(pixel % width), mi.Float(pixel // width))
    place = (corner + sampler.next_2d()) / mi.Vector2f(width, height)
    aperture = sampler.next_2d() if sensor.needs_aperture_sample() else mi.Point2f(0.5)
    time = sensor.shutter_open() + sampler.next_1d() * sensor.shutter_open_time()
    ray, weight = sensor.sample_ray(time, 0.0, mi.Point2f(place), aperture)
    medium = sensor.get_medium()
    follow(
        loaded.scene,
        projector_of(loaded.scene),
        sampler,
        ray,
        weight,
        medium if _is_scalar() else mi.MediumPtr(medium),
        rules,
        tally,
        row,
    )
