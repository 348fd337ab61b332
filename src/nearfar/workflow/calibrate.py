"""Measure how a rig's projector and camera turn numbers into light and light into numbers.

Index convention: photos are (Cy, Cx, channels), raw levels.
"""

from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.errors import DeviceError
from nearfar.photometry.exposures import Sensor
from nearfar.photometry.response import (
    Linearity,
    fit_linearity,
    fit_response,
    fit_sensor_noise,
    pair_noise,
    unmix_response,
)
from nearfar.progress import Report, ignore_progress
from nearfar.rigs.base import Photo
from nearfar.rigs.calibration import Calibration
from nearfar.rigs.linear import LinearProjector
from nearfar.rigs.real.rig import RealRig

# The ramp's levels: close together where a gamma is steep.
RAMP_LEVELS = tuple(int(v) for v in np.unique(np.rint(np.linspace(0, 255, 33))))
# Levels at which the linearised ramp is checked.
CHECK_LEVELS = (32, 64, 96, 128, 160, 192, 224)
# Values from this share of full scale on are clipped.
CLIPPED_SHARE = 0.98
# Multiples of the exposure at which the camera's own linearity is measured, under a dim light.
EXPOSURE_FACTORS = (1, 2, 3, 4, 5, 6, 8)
# Camera pixels take part where white adds this share of what it adds to the brightest.
LIT_SHARE_OF_BRIGHTEST = 0.1
# Errors above these are reported: of the camera's linearity, as a share of full scale; and, as
# shares of white, of the sum of the primaries, of the linearised ramp, and of ambient light.
MAXIMUM_LINE_ERROR = 0.01
MAXIMUM_SUPERPOSITION_ERROR = 0.02
MAXIMUM_RAMP_ERROR = 0.01
MAXIMUM_AMBIENT_SHARE = 0.1
# A camera resolves the primaries if its mixing matrix has a smaller condition number.
MAXIMUM_CONDITION_NUMBER = 30.0


class Findings(NamedTuple):
    """A calibration, what it was read from, and what a user should know.

    Attributes
    ----------
    calibration : Calibration
    levels, light : array, shape (n,) and (n, channels)
        The ramp, light over white's.
    checked : array, shape (m, 2)
        Levels of the linearised ramp and their light, over 255 and white's.
    exposures : array, shape (k, 2)
        Seconds and mean level, where the exposure can be set.
    noise : array, shape (g, 2)
        Mean level and variance of groups of pixels.
    notes : tuple of str
        Sentences.
    """

    calibration: Calibration
    levels: NDArray[np.int64]
    light: Floats
    checked: Floats
    exposures: Floats
    noise: Floats
    notes: tuple[str, ...]


def calibrate(rig: RealRig, progress: Report = ignore_progress) -> Findings:
    """Calibrate a rig before a scene that does not move.

    Every light is photographed with the pattern grid full of it, in random order, so that a lamp
    that drifts does not look like a response.

    Parameters
    ----------
    rig : RealRig
        Without a calibration, so that levels are displayed as they are.
    progress : callable, optional
        Called with what is being done and the share of it that is done, 0 to 1.

    Returns
    -------
    Findings

    Raises
    ------
    DeviceError
        If the camera saturates, sees nothing, or devices fail.
    InputError
        If the photos do not follow the levels.
    """
    report = progress
    levels = rig.synchronise()
    lit = _lit(levels.white - levels.black)
    full = rig.camera.full_scale
    if float(np.mean(levels.white[lit] >= CLIPPED_SHARE * full)) > 0.01:
        raise DeviceError(
            f"{rig.camera.name} is saturated by white: give a shorter exposure, or close its "
            f"aperture."
        )
    generator = np.random.default_rng(0)
    ramp = generator.permutation(np.repeat(RAMP_LEVELS, 2))
    photos: dict[int, list[Photo]] = {level: [] for level in RAMP_LEVELS}
    for i, level in enumerate(ramp):
        photos[int(level)].append(rig.photograph_levels((level, level, level)))
        report("grey ramp", (i + 1) / len(ramp))
    black_light = _light(photos[0], lit)
    light = np.stack([_light(photos[level], lit) - black_light for level in RAMP_LEVELS])
    primaries = []
    for primary in range(3):
        red, green, blue = (255 if p == primary else 0 for p in range(3))
        pair = [rig.photograph_levels((red, green, blue)) for _ in range(2)]
        primaries.append(_light(pair, lit) - black_light)
        report("primaries", (primary + 1) / 3)
    mixing = np.stack(primaries, axis=-1)
    white = light[-1]
    superposition = float(mixing.sum() / white.sum() - 1)
    notes = []
    projected = np.asarray(RAMP_LEVELS)
    if abs(superposition) > MAXIMUM_SUPERPOSITION_ERROR:
        notes.append(
            f"red, green and blue together give {1 + superposition:.1%} of white: turn the "
            f"projector's white segment or brightness boost off; until then its levels are "
            f"linearised for grey alone."
        )
    channels = len(white)
    apart = channels >= 3 and np.linalg.cond(mixing) < MAXIMUM_CONDITION_NUMBER
    if apart and abs(superposition) <= MAXIMUM_SUPERPOSITION_ERROR:
        response = unmix_response(projected, light, mixing)
    else:
        response = np.repeat(fit_response(projected, light.sum(axis=-1))[:, np.newaxis], 3, axis=1)
    line, exposures = _camera_line(rig, lit, light.sum(axis=-1) / white.sum(), report)
    black = line.black if line else 0.0
    dark = _dark_pair(rig)
    sensor, noise = _noise([*photos.values(), *([dark] if dark else [])], black, full)
    if line is None:
        notes.append(
            "the camera's linearity and black level could not be measured, because its exposure "
            "cannot be set from here, or every setting is too bright: make sure that its levels "
            "are linear, for instance by raw files."
        )
    elif line.worst > MAXIMUM_LINE_ERROR:
        notes.append(
            f"the camera's levels deviate from a straight line by up to {line.worst:.1%} of full "
            f"scale: use raw or uncompressed files, and turn its gamma off."
        )
    checked = _checked(rig, response, lit, black_light, report)
    residual = float(np.abs(checked[:, 1] - checked[:, 0]).max())
    if residual > MAXIMUM_RAMP_ERROR:
        notes.append(
            f"the linearised ramp still deviates from a line by up to {residual:.1%} of white: the "
            f"projector's response depends on the picture, so turn its picture enhancement off."
        )
    ambient = float(max(0.0, (black_light.mean() - black) / full))
    if ambient > MAXIMUM_AMBIENT_SHARE * float(white.mean()) / full:
        notes.append(
            f"light under a black pattern is {ambient * full / float(white.mean()):.0%} of "
            f"white's: darken the room."
        )
    calibration = Calibration(
        made=datetime.now(UTC).isoformat(timespec="seconds"),
        monitor=rig.monitor.name,
        camera=rig.camera.name,
        exposure=rig.camera.exposure,
        response=tuple(tuple(map(float, row)) for row in response),
        mixing=tuple(tuple(map(float, row)) for row in mixing / white.max()),
        black=black,
        gain=sensor.gain,
        read=sensor.read,
        ambient=ambient,
        linearity=line.worst if line else None,
        superposition=superposition,
        residual=residual,
    )
    return Findings(calibration, projected, light / white, checked, exposures, noise, tuple(notes))


def _lit(contrast: Floats) -> NDArray[np.bool_]:
    """Camera pixels that see the projector, (Cy, Cx)."""
    seen = contrast.sum(axis=-1)
    return np.asarray(seen > LIT_SHARE_OF_BRIGHTEST * np.quantile(seen, 0.999))


def _light(photos: list[Photo], lit: NDArray[np.bool_]) -> Floats:
    """Mean level of lit camera pixels, (channels,)."""
    means = [photo[lit].mean(axis=0, dtype=np.float64) for photo in photos]
    return np.asarray(np.stack(means).mean(axis=0))


def _camera_line(
    rig: RealRig, lit: NDArray[np.bool_], light: Floats, report: Report
) -> tuple[Linearity | None, Floats]:
    camera, shortest = rig.camera, rig.camera.exposure
    if shortest is None or camera.exposure_limits is None:
        return None, np.zeros((0, 2))
    level = RAMP_LEVELS[max(1, int(np.searchsorted(light, 1 / (1.2 * EXPOSURE_FACTORS[-1]))) - 1)]
    lengths = [n * shortest for n in EXPOSURE_FACTORS if n * shortest <= camera.exposure_limits[1]]
    seconds, photos = [], []
    try:
        for i, length in enumerate(lengths):
            seconds.append(camera.set_exposure(length))
            photos.append(rig.photograph_levels((level, level, level)))
            report("exposures", (i + 1) / len(lengths))
    finally:
        camera.set_exposure(shortest)
    # The same camera pixels at every exposure: a glint is saturated long before the rest.
    while len(photos) > 1:
        below = np.all(
            [photo < CLIPPED_SHARE * camera.full_scale for photo in photos], axis=(0, -1)
        )
        good = lit & below
        if good.sum() > lit.sum() / 2:
            break
        del seconds[-1], photos[-1]
    if len(photos) < 2:
        return None, np.zeros((0, 2))
    means = [float(photo[good].mean(dtype=np.float64)) for photo in photos]
    points = np.stack([seconds, means], axis=-1)
    return fit_linearity(points[:, 0], points[:, 1], camera.full_scale), points


def _dark_pair(rig: RealRig) -> list[Photo]:
    """Return two photos of as little light as there is, whose noise is read noise alone."""
    camera, usual = rig.camera, rig.camera.exposure
    if usual is None or camera.exposure_limits is None:
        return []
    try:
        camera.set_exposure(camera.exposure_limits[0])
        return [rig.photograph_levels((0, 0, 0)) for _ in range(2)]
    finally:
        camera.set_exposure(usual)


def _noise(pairs: list[list[Photo]], black: float, full: float) -> tuple[Sensor, Floats]:
    groups = [pair_noise(one, other, full) for one, other in pairs]
    means = np.concatenate([mean for mean, _ in groups])
    variances = np.concatenate([variance for _, variance in groups])
    return fit_sensor_noise(means, variances, black), np.stack([means, variances], axis=-1)


def _checked(
    rig: RealRig, response: Floats, lit: NDArray[np.bool_], black: Floats, report: Report
) -> Floats:
    """Photograph a linearised ramp; return levels over 255 and light over white's."""
    linear = LinearProjector(response, rig.layout)
    grid = np.ones(rig.projector, dtype=np.uint8)
    found = []
    for i, level in enumerate((*CHECK_LEVELS, 255)):
        photo = rig.photograph(linear.draw(np.uint8(level) * grid))
        found.append((level / 255, float((_light([photo], lit) - black).sum())))
        report("linearised ramp", (i + 1) / (len(CHECK_LEVELS) + 1))
    points = np.asarray(found)
    points[:, 1] /= points[-1, 1]
    return points
