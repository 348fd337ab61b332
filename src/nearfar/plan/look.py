"""Looks: first estimates of scenes, from few photos, by which to plan for more photos."""

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from nearfar.arrays import Size
from nearfar.plan.choose_frequencies import choose_frequencies
from nearfar.plan.typical import noise_of, typical_of
from nearfar.plan.window import largest_window, pitch_of
from nearfar.priors.component import PriorComponent
from nearfar.priors.fitted import FREE
from nearfar.priors.typical import TypicalScenes
from nearfar.transport.posterior import Posterior

if TYPE_CHECKING:
    # A plan needs none of what a transport computes with.
    from nearfar.transport.model import Transport

# W over the distance in which near-range light falls by a factor e: it leaves a fourth of a falling
# exponential outside.
WINDOW_OVER_REACH = 5.4
# As large as the window that is chosen without a look, on the largest projectors.
LARGEST_WINDOW = 25
# Near-range light of less than this share of all light tells no reach.
LEAST_NEAR_SHARE = 0.01
# The model does not hold where camera pixels with free rows have more than this share of the
# squared light. In looks of 30 to 80 photos it was at most 0.08 on the built-in scenes, and 0.15 to
# 0.85 on caustics, glass, hair, dense and permuted rows.
LARGEST_FREE_SHARE = 0.12


class Look(NamedTuple):
    """Priors, noise and reach of near-range light in a first estimate of a scene.

    Attributes
    ----------
    typical : TypicalScenes
        The mixture of prior components that the estimate chose.
    noise : float
        Standard deviation of the response to a sinusoid, as a share of white.
    window : int
        W of the estimate.
    reach : float or None
        Projector pixels in which near-range light falls by a factor e, at most the look's W; None
        if there is hardly any.
    wanted_window : int
        W that holds near-range light of this reach; not below that of the estimate.
    free_share : float
        Share of the squared light at camera pixels whose rows no model describes.
    """

    typical: TypicalScenes
    noise: float
    window: int
    reach: float | None
    wanted_window: int
    free_share: float

    @property
    def model_holds(self) -> bool:
        """Whether direct, near-range and far-range light describe the scene."""
        return self.free_share <= LARGEST_FREE_SHARE

    @property
    def has_outlines(self) -> bool:
        """Whether much of the light is of components with a sharp outline on the projector."""
        components, shares = self.typical.prior_components, self.typical.shares[0]
        outlined = [component.far_power > 0 for component, _ in components]
        return float(shares @ outlined) > LARGEST_FREE_SHARE


def look_at(transport: "Transport") -> Look:
    """Return priors, noise and reach of near-range light of a first estimate.

    Parameters
    ----------
    transport : Transport
        From few photos, estimated jointly.

    Raises
    ------
    InputError
        If it was not estimated jointly.
    """
    typical = typical_of(transport)
    # Second places are found: the model holds there.
    found = typical_of(replace(transport, second_place=None, second_direct=None))
    free = [_is_free(component) for component, _ in found.prior_components]
    reach = _reach(transport)
    wanted = 0 if reach is None else 2 * round((WINDOW_OVER_REACH * reach - 1) / 2) + 1
    # All odd; a look tells little of what lies far beyond its own window.
    last = largest_window(transport.projector, transport.pitch)
    largest = min(LARGEST_WINDOW, last - 1 + last % 2, 2 * transport.window - 1)
    return Look(
        typical=typical,
        noise=noise_of(transport),
        window=transport.window,
        reach=reach,
        wanted_window=max(transport.window, min(wanted, largest)),
        free_share=float(found.shares[0] @ free),
    )


def photos_for_window(look: Look, projector: Size, photos: int, window: int) -> int:
    """Return how many photos leave as little unknown with a window as with the look's own.

    Parameters
    ----------
    look : Look
    projector : Size
    photos : int
        With the look's own window.
    window : int
        W, larger than the look's.

    Returns
    -------
    int
        By the expected SNR_b under pictures, which is taken to grow evenly with the logarithm of
        the photos.
    """

    def expected(photos: int, window: int) -> float:
        choice = choose_frequencies(
            projector,
            photos,
            window,
            pitch=pitch_of(projector),
            typical=look.typical,
            noise=look.noise,
        )
        return choice.expected.pictures

    before = expected(photos, look.window)
    now, twice = (expected(count, window) for count in (photos, 2 * photos))
    doublings = max(before - now, 0.0) / max(twice - now, 1e-3)
    return round(photos * 2 ** min(doublings, 4.0))


def _is_free(component: PriorComponent) -> bool:
    """Return whether light anywhere on the projector is alike, in a prior component."""
    return component.far_decay >= FREE and component.far_power == 0


def _reach(transport: "Transport") -> float | None:
    """Return the functions over which the mean window falls by a factor e; None without light.

    The entry at q is left out, where near-range light is hard to tell from direct light.
    """
    side = np.abs(np.arange(transport.window) - transport.window // 2)
    distance = np.maximum(side[:, None], side)
    coarsest = transport.near.reshape(*transport.near.shape[:3], -1)[..., : transport.window**2]
    window = coarsest.astype(np.float64).mean(axis=(0, 1, 2)).reshape(side.size, side.size)
    # Beyond a projector of a single row entries are 0.
    entries = [window[(distance == r) & (window != 0)] for r in range(1, transport.window // 2 + 1)]
    light = np.array([float(np.mean(entry)) for entry in entries if entry.size])
    posterior = transport.posterior
    white = float(posterior.white.mean()) if isinstance(posterior, Posterior) else 0.0
    if len(light) < 2 or window.sum() < LEAST_NEAR_SHARE * white or light[0] <= 0:
        return None
    bright = np.maximum(light, 1e-3 * light[0])
    slope = np.polyfit(np.arange(len(light)), np.log(bright), 1, w=np.sqrt(bright))[0]
    return float(1.0 / max(-slope, 1.0 / transport.window))
