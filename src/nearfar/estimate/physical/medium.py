"""The medium that a body's camera pixels share, and direct and subsurface light of each.

Responses to waves, with the phase at q taken out, are d e(k) + s S(k) + g(k): direct light through
its footprint, the kernel of the medium on a surface of some slope, cut off where light falls beside
the body, and inter-reflection. Of g only its power over frequencies is known, and that from what is
left of the responses. Two numbers of each channel are fitted for the whole body: depth of the
source and attenuation. With them shared, d and s are told apart where a camera pixel alone could
not tell its subsurface light at q from direct light.

Index convention: c runs over the body's camera pixels, r over real responses.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, optimize

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.estimate.physical.body import BATCH_PIXELS, Body
from nearfar.estimate.physical.kernels import slopes, source_at
from nearfar.parallel import side_by_side
from nearfar.transport.dipole import Dipole

# First guesses of the source's depth in cells, and of attenuation times depth.
DEPTHS = (0.5, 1.0, 2.0)
PRODUCTS = (0.1, 0.4, 1.0)
# Least and largest: depths in cells that responses can tell, and products sqrt(3 (1 - a')) of media
# that scatter.
RANGES = ((0.2, 4.0), (0.01, 1.7))
# Depth in cells above which light under a surface is all but direct light. Sources are expected not
# to lie there: the standard deviation, in logarithms, by which they do (docs/decisions/0112).
SHALLOW, SHALLOW_DEVIATION = 0.4, 0.2
# Depth of a source in cells beyond which light that is compared is too near to it to tell how it
# fades.
DEEP = 2.0
# Logarithms this close to them are at them.
AT_BOUND = 0.01
# Camera pixels that the medium is fitted to, and how far a misfit may stand out from the median.
SAMPLE = 300
OUTLYING = 9.0
SLOPES = slopes((0.6, 1.3), 4)
# A slope must fit better than a flat surface by this factor.
FLAT_PREFERENCE = 0.97
# Power of inter-reflection over that of fast waves, before any fit: at DC, and the cycles per
# projector pixel by which it has fallen to half.
SLOW_POWER = 10.0
SLOW = 0.03
# Responses whose frequencies are next to each other have the same power.
LIKE_RESPONSES = 7
# Of a squared Gaussian, median over mean.
MEDIAN_OF_SQUARES = 0.455
# No response is known better than the mean by this factor in power.
LEAST_POWER = 1e-3
# Attenuation times depth of a channel is unlike that of the others if it is less than their mean by
# this factor; or less than that of any by it, where it is also so small that light hardly fades
# within the window.
UNLIKE, FAINT = 4.0, 0.03
# Standard deviations, in logarithms, of what the other channels tell of depth and of attenuation
# times depth: scattering changes little with the colour of light, absorption much. And how many
# camera pixels this is weighed against, as errors of the model are the same all over a body.
LIKE_DEVIATIONS = np.array([0.3, 0.9])
INDEPENDENT = 3.0
ROUNDS = 3
ITERATIONS = 60
# A source is found where logarithms differ by no more, and misfits by no larger a share.
LIKE_LOGARITHMS, LIKE_MISFITS = 0.01, 1e-7


class Amplitudes(NamedTuple):
    """Direct and subsurface light fitted to responses.

    Attributes
    ----------
    direct, subsurface : ndarray, shape (m,)
        d, and s of a kernel of unit albedo, at least 0.
    left : ndarray, shape (m, R)
        Responses less both.
    """

    direct: Floats
    subsurface: Floats
    left: Floats


class Media(NamedTuple):
    """What a body is made of.

    Attributes
    ----------
    sources : tuple of Dipole
        One for each channel; lengths in cells.
    slope : ndarray of int, shape (n,)
        Which of `SLOPES` each camera pixel sees.
    direct, amplitude : ndarray, shape (n, channels)
        d and s.
    explained : ndarray, shape (n,)
        Share that the kernels explain of what direct light leaves, 1 at best.
    """

    sources: tuple[Dipole, ...]
    slope: Integers
    direct: Floats
    amplitude: Floats
    explained: Floats


def media_of(body: Body) -> Media:
    """Fit the media of a body, one for each channel, and the slopes they have in common.

    Parameters
    ----------
    body : Body

    Returns
    -------
    Media
    """
    slope: Integers = np.zeros(len(body.pixels), dtype=np.int64)
    sample, power = _sample(body), _power_before(body)
    sources = [
        min(_guesses(), key=lambda one: _misfit(body, i, one, slope, power[i], sample))
        for i in range(len(power))
    ]
    return _settled(body, sources, slope, np.full((len(sources), 2), np.nan))


def with_like_channels(body: Body, media: Media) -> Media:
    """Return media in which light fades in every channel, if it does in most.

    A channel whose kernel reaches as far as responses tell anything may be taken for one that
    hardly fades. It is then fitted anew, and the depth and the fading of the other channels are
    expected of it.

    Parameters
    ----------
    body : Body
    media : Media

    Returns
    -------
    Media
    """
    unlike = unlike_channels(media)
    if not unlike.any():
        return media
    found = np.stack([_logarithms(source) for source in media.sources])
    like = found[~unlike].mean(axis=0)
    depth, product = np.exp(like)
    start = source_at(float(depth), float(product / depth))
    sources = [
        start if other else source for other, source in zip(unlike, media.sources, strict=True)
    ]
    return _settled(body, sources, media.slope, np.where(unlike[:, None], like, np.nan))


def unlike_channels(media: Media) -> Booleans:
    """Return the channels in which light fades much less than in others, shape (channels,).

    Parameters
    ----------
    media : Media
    """
    product = np.array([source.attenuation * source.real for source in media.sources])
    if len(product) == 1:
        return np.zeros(1, dtype=bool)
    of_others = np.exp(_of_others(media)[:, 1])
    unlike = (product < of_others / UNLIKE) | (product < FAINT)
    return np.asarray(unlike & (product < product.max() / UNLIKE))


def _of_others(media: Media) -> Floats:
    """Return the mean logarithms of all other channels for each, (channels, 2); NaN if alone."""
    found = np.stack([_logarithms(source) for source in media.sources])
    if len(found) == 1:
        return np.full(found.shape, np.nan)
    return np.asarray((found.sum(axis=0) - found) / (len(found) - 1))


def _settled(body: Body, sources: Sequence[Dipole], slope: Integers, expected: Floats) -> Media:
    """Refine sources, slopes and the power of what is left in turn.

    Parameters
    ----------
    body : Body
    sources : sequence of Dipole
        Where to begin, for each channel.
    slope : ndarray of int, shape (n,)
    expected : ndarray, shape (channels, 2)
        Logarithms of depth, and of attenuation times depth; NaN where nothing is expected.
    """
    everywhere, sample, power = np.arange(len(body.pixels)), _sample(body), _power_before(body)
    fits: list[Amplitudes] = []
    for _ in range(ROUNDS):
        sources = [
            _refined(body, i, source, slope, power[i], sample, expected[i])
            for i, source in enumerate(sources)
        ]
        slope = _slopes(body, sources, power)
        fits = [
            _fit_slopes(body, i, source, slope, power[i], everywhere)
            for i, source in enumerate(sources)
        ]
        power = np.stack([power_of(body, fit.left) for fit in fits])
    return Media(
        tuple(sources),
        slope,
        np.stack([fit.direct for fit in fits], axis=1),
        np.stack([fit.subsurface for fit in fits], axis=1),
        _explained(body, fits, power),
    )


def fitted_again(body: Body, media: Media) -> Media:
    """Fit media of a translucent body from those that are near, all channels with like fading.

    Of each channel the mean depth, and attenuation times depth, of the others are expected.

    Parameters
    ----------
    body : Body
    media : Media

    Returns
    -------
    Media
    """
    return _settled(body, media.sources, media.slope, _of_others(media))


def kernels_of(body: Body, source: Dipole, slope: Integers, chosen: Integers) -> Floats:
    """Return the responses of chosen camera pixels to kernels, each on its own slope, (m, R)."""
    shape = np.empty((len(chosen), len(body.frequency)))
    for number in np.unique(slope[chosen]):
        here = slope[chosen] == number
        shape[here] = body.to_kernel(source, SLOPES[number], chosen[here])
    return shape


def is_even(media: Media) -> bool:
    """Return whether light hardly fades as far as kernels are compared.

    The source then ended at the greatest depth in any channel, or the attenuation at the least in
    all of them, or in one whose source is deep.
    """
    least, most = np.log(RANGES).T
    found = np.stack([_logarithms(source) for source in media.sources])
    deepest, faint = found[:, 0] > most[0] - AT_BOUND, found[:, 1] < least[1] + AT_BOUND
    deep = found[:, 0] > np.log(DEEP)
    return bool(deepest.any() or faint.all() or np.any(deep & faint))


def is_deep(media: Media) -> bool:
    """Return whether kernels are compared too near to q to tell the medium, in any channel."""
    return max(source.real for source in media.sources) > DEEP


def _sample(body: Body) -> Integers:
    """Return the camera pixels that media are fitted to, as indices of the body's."""
    return np.random.default_rng(0).permutation(np.flatnonzero(body.inner))[:SAMPLE]


def _power_before(body: Body) -> Floats:
    """Return the power of inter-reflection before any fit, (channels, R)."""
    power = 1 + SLOW_POWER / (1 + (body.frequency / SLOW) ** 3)
    return np.tile(power, (body.responses.shape[1], 1))


def _guesses() -> list[Dipole]:
    return [source_at(depth, product / depth) for depth in DEPTHS for product in PRODUCTS]


def _logarithms(source: Dipole) -> NDArray[np.float64]:
    """Return logarithms of the depth, and of attenuation times depth."""
    return np.log([source.real, source.attenuation * source.real])


def amplitudes(
    body: Body, channel: int, shape: Floats, power: Floats, chosen: Integers
) -> Amplitudes:
    """Fit d and s to responses of some power of what they leave, by weighted least squares.

    Parameters
    ----------
    body : Body
    channel : int
    shape : ndarray, shape (m, R)
        Responses to a kernel of unit amplitude.
    power : ndarray, shape (R,)
    chosen : ndarray of int, shape (m,)
        Indices into the body's camera pixels.

    Returns
    -------
    Amplitudes
    """
    responses, unit = body.responses[chosen, channel], body.to_direct[chosen]
    weighed_unit, weighed_shape = unit / power, shape / power
    of_direct, of_both, with_direct = (
        np.vecdot(weighed_unit, other) for other in (unit, shape, responses)
    )
    of_shape, with_shape = (np.vecdot(weighed_shape, other) for other in (shape, responses))
    determinant = of_direct * of_shape - of_both**2
    tiny = np.finfo(float).tiny
    subsurface = (of_direct * with_shape - of_both * with_direct) / np.maximum(determinant, tiny)
    subsurface = np.maximum(subsurface, 0.0)
    direct = (with_direct - subsurface * of_both) / of_direct
    left = responses - direct[:, None] * unit - subsurface[:, None] * shape
    return Amplitudes(direct, subsurface, left)


def _fit_slopes(
    body: Body, channel: int, source: Dipole, slope: Integers, power: Floats, chosen: Integers
) -> Amplitudes:
    """Fit chosen camera pixels, each on its own slope."""
    return amplitudes(body, channel, kernels_of(body, source, slope, chosen), power, chosen)


def _weighed(left: Floats, power: Floats) -> Floats:
    """Return the sum of squares over power, shape (m,)."""
    return np.asarray(np.vecdot(left / power, left))


def _misfit(
    body: Body, channel: int, source: Dipole, slope: Integers, power: Floats, sample: Integers
) -> float:
    left = _fit_slopes(body, channel, source, slope, power, sample).left
    found = _weighed(left, power)
    return float(np.minimum(found, OUTLYING * np.median(found)).sum())


def _refined(
    body: Body,
    channel: int,
    source: Dipole,
    slope: Integers,
    power: Floats,
    sample: Integers,
    expected: Floats,
) -> Dipole:
    """Return the source that fits best, from one that is near."""
    weight = len(sample) / INDEPENDENT

    def source_of(logarithms: NDArray[np.float64]) -> Dipole:
        depth, product = np.exp(np.clip(logarithms, *np.log(RANGES).T))
        return source_at(float(depth), float(product / depth))

    def misfit(logarithms: NDArray[np.float64]) -> float:
        apart = np.nansum(((logarithms - expected) / LIKE_DEVIATIONS) ** 2)
        shallow = min(float(logarithms[0] - np.log(SHALLOW)), 0.0) / SHALLOW_DEVIATION
        found = _misfit(body, channel, source_of(logarithms), slope, power, sample)
        return found + weight * (float(apart) + shallow**2)

    start = _logarithms(source)
    alike = LIKE_MISFITS * misfit(start)
    best = optimize.minimize(
        misfit,
        start,
        method="Nelder-Mead",
        options={"maxiter": ITERATIONS, "xatol": LIKE_LOGARITHMS, "fatol": alike},
    )
    return source_of(best.x)


def _slopes(body: Body, sources: list[Dipole], power: Floats) -> Integers:
    """Choose the slope that fits each camera pixel and those about it in all channels."""
    everywhere = np.arange(len(body.pixels))
    misfits = np.zeros((len(SLOPES), len(everywhere)))
    for number, slope in enumerate(SLOPES):
        for i, source in enumerate(sources):
            shape = body.to_kernel(source, slope, everywhere)
            misfits[number] += body.share(_misfits(body, i, shape, power[i]))
    misfits[0] *= FLAT_PREFERENCE
    return np.asarray(misfits.argmin(axis=0))


def _misfits(body: Body, channel: int, shape: Floats, power: Floats) -> Floats:
    """Return the weighted sum of squared residuals of each camera pixel, shape (n,)."""
    found = np.empty(len(shape))

    def work(batch: slice) -> None:
        chosen = np.arange(*batch.indices(len(shape)))
        found[batch] = _weighed(amplitudes(body, channel, shape[batch], power, chosen).left, power)

    side_by_side(work, blocks(len(shape), BATCH_PIXELS))
    return found


def power_of(body: Body, left: Floats) -> Floats:
    """Return the power of what a fit leaves (n, R), smooth over frequencies, shape (R,)."""
    own = np.median(left[body.inner] ** 2, axis=0) / MEDIAN_OF_SQUARES
    rising = np.argsort(body.frequency, kind="stable")
    power = np.empty_like(own)
    power[rising] = ndimage.uniform_filter1d(own[rising], LIKE_RESPONSES, mode="nearest")
    return np.asarray(power + LEAST_POWER * power.mean() + np.finfo(float).tiny)


def _explained(body: Body, fits: list[Amplitudes], power: Floats) -> Floats:
    """Return the share of what direct light leaves that kernels explain, over all channels."""
    left, without = np.zeros(len(body.pixels)), np.zeros(len(body.pixels))
    unit = body.to_direct
    for i, fit in enumerate(fits):
        responses = body.responses[:, i]
        weighed = unit / power[i]
        alone = np.vecdot(weighed, responses) / np.vecdot(weighed, unit)
        left += _weighed(fit.left, power[i])
        without += _weighed(responses - alone[:, None] * unit, power[i])
    return np.asarray(1 - left / np.maximum(without, np.finfo(float).tiny))
