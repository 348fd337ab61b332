"""What it gains that several projectors share photos, by their whites and the camera's noise.

A response is twice a photo of mean level black + W_i / 2, or from m shared photos of mean level
black + (W_1 + W_2 + ...) / 2, with 1 / m of their variance. Where projectors light different parts
of the scene, or time bounds the exposure, sharing gains up to 10 log10 m. Where they light the same
part and full scale bounds the exposure, each has its share of it alone, and sharing loses.

Index convention: i runs over projectors, y and x over camera pixels.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from nearfar.arrays import AnySize, Floats
from nearfar.errors import InputError
from nearfar.photometry.noise import NoiseModel
from nearfar.plan import Plan
from nearfar.plan.choose import choose_plan
from nearfar.plan.expect import Expected
from nearfar.plan.sharing import shared_plan, signs


class SharingGain(NamedTuple):
    """What sharing gains over photos one projector after the other, of the same number.

    Attributes
    ----------
    decibels : float
        Of the noise of all responses; negative where sharing loses.
    noise_in_turn, noise_shared : float
        Standard deviation of the response to a sinusoid, as a share of white, as
        `nearfar.choose_plan` takes it.
    """

    decibels: float
    noise_in_turn: float
    noise_shared: float


def sharing_gain(
    whites: Floats,
    black: Floats,
    noise: Sequence[NoiseModel],
    *,
    exposures: tuple[float, float] = (1.0, 1.0),
) -> SharingGain:
    """Compare the noise of photos that projectors share with that of photos in turn.

    Parameters
    ----------
    whites : ndarray, shape (i, Cy, Cx, channels)
        Photo of white by each projector alone, photo units.
    black : ndarray, shape (Cy, Cx, channels)
        Photo of black.
    noise : sequence of NoiseModel
        Of each channel.
    exposures : tuple of float
        Of photos in turn, and of shared photos, over that of `whites`; see `largest_exposures`.

    Returns
    -------
    SharingGain

    Raises
    ------
    InputError
        If no white is brighter than black.
    """
    light = np.asarray(whites, dtype=np.float64) - black
    count, photos = len(light), len(signs(len(light)))
    power = float(np.sum(light**2))
    if not power > 0:
        raise InputError(
            "no projector lights the scene: photograph white by each while the others are dark."
        )
    alone, together = exposures
    # As many photos in turn as shared ones: each pattern photos / count times.
    in_turn = _variance(black + alone * light / 2, noise) * count / photos / alone**2
    shared = count * _variance(black + together * light.sum(axis=0) / 2, noise)
    shared /= photos * together**2
    return SharingGain(
        float(10 * np.log10(in_turn / shared)),
        *(float(2 * np.sqrt(variance / power)) for variance in (in_turn, shared)),
    )


def largest_exposures(whites: Floats, black: Floats, level: float = 0.9) -> tuple[float, float]:
    """Return exposures, in turn and shared, at which no white is brighter than a level.

    Parameters
    ----------
    whites, black
        As `sharing_gain`.
    level : float
        Share of full scale.

    Returns
    -------
    tuple of float
        Over that of `whites`. All projectors have the same exposure, so that their light adds up.
        Camera pixels that are brighter than the level under black do not count.

    Raises
    ------
    InputError
        If no camera pixel is lit and below the level under black.
    """
    light = np.asarray(whites, dtype=np.float64) - black
    room = level - black

    def largest(lit: Floats) -> float:
        counted = (lit > 0) & (room > 0)
        if not counted.any():
            raise InputError(
                f"every camera pixel that a projector lights is above {level:.0%} of full scale "
                f"under black: expose less, or keep ambient light out."
            )
        return float(np.min(room[counted] / lit[counted]))

    return largest(light.max(axis=0)), largest(light.sum(axis=0))


def choose_plan_together(
    projector: AnySize,
    photos: int,
    gain: SharingGain,
    projectors: int,
    *,
    window: int | None = None,
) -> tuple[Plan, Expected]:
    """Choose the plan for several projectors, shared if that is expected to relight better.

    Parameters
    ----------
    projector : Size
        Pattern grid of each projector.
    photos : int
        For each projector; all together are about `projectors` times as many.
    gain : SharingGain
    projectors : int
    window : int, optional
        As `nearfar.choose_plan`.

    Returns
    -------
    plan : Plan
        That of `nearfar.plan.sharing.shared_plan`, or one to photograph by each projector in turn.
    expected : Expected
        SNR_b expected of relighting the typical scenes, by the better way.
    """
    in_turn = choose_plan(projector, photos, window=window, noise=gain.noise_in_turn)
    order = len(signs(projectors))
    together = choose_plan(
        projector, photos * projectors // order, window=window, noise=gain.noise_shared
    )
    if together[1].pictures > in_turn[1].pictures:
        return shared_plan(together[0], projectors), together[1]
    return in_turn


def _variance(level: Floats, noise: Sequence[NoiseModel]) -> float:
    """Return the sum of the variances of photos (..., channels)."""
    each = [model.variance(level[..., channel]).sum() for channel, model in enumerate(noise)]
    return float(np.sum(each))
