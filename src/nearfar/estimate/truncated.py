"""The variance of what an estimate misses of far-range light.

It misses all of what the transport does not hold, and, at frequencies that it holds, what the prior
shrinks: with a gain g, (1 - g)^2 of the power. The prior expects the same of it all over a row. It
lies where the row has light, though: most of it are the edges and peaks of bright entries. With
h_k^2 the spectral density of what is missed, a light l has the variance sum_p (h * l)(p)^2. Each
projector pixel p then counts by the power of F about it.

A row whose responses fade over few cycles may still have an outline, like that of a disc of lamps,
which alone is left at the frequencies that were not measured. The variance that such a row misses
is therefore a weighted mean: of what its component expects, and of what light with edges would have
there if its power at the measured frequencies were the same.

Rows of few bright entries leave errors with heavy tails: one standard deviation would hold 80 to
90 % of them. An error bar is half the width of the interval that holds 68 %, and is narrower there:
the more so, the more of the row is not known. The more projector pixels a light has, the closer the
sum of their errors is to a Gaussian.

Index convention: n runs over camera pixels, p over projector pixels.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

from nearfar.arrays import Booleans, Floats, Integers, Size, blocks
from nearfar.illumination.frequencies import DC
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import spectral_density
from nearfar.priors.fitted import LIGHT_WITH_EDGES
from nearfar.transport.model import Transport

# Far decay, in cycles, up to which rows without near-range light may have outlines that no photo
# shows, and the weight of these in the variance that such rows miss. Fitted to lamps of three sizes
# (docs/decisions/0109).
FADING = 3.0
WEIGHT_OF_OUTLINES = 0.35
# Standard deviation, in projector pixels, of the Gaussian that says what is about an entry.
ABOUT = 0.5
# Share of the variance that is the same for all projector pixels.
EVERYWHERE = 0.05
# Kurtosis about 0 of values that are spread evenly from 0 to their largest.
EVEN_KURTOSIS = 1.8
# How much narrower an error bar is than one standard deviation, as a share of it, where nothing is
# known of a row but that its entries are few; and the excess kurtosis at which 63 % of that is
# reached. Fitted to 68th percentiles of errors of single projector pixels on hostile transports.
NARROWED = 0.75
SPARSE_EXCESS = 1.0
# Share of a variance that is left at the least; less is rounding.
LEAST_LEFT = EVERYWHERE * (1 - NARROWED) ** 2
# Smaller shares of a light's response to DC are rounding.
ROUNDING = 1e-9
# Keeps quotients finite, and so are its squares.
TINY = float(np.finfo(np.float64).tiny) ** 0.5
# Powers of 2 of variance ratios that are told apart; of the last, measurements are exact.
OCTAVES = -30, 60
# Values of rows that are computed at once.
VALUES_AT_ONCE = 2**23


def truncated_variance(
    transport: Transport, light: Floats, prior_components: Sequence[PriorComponent]
) -> Floats:
    """Return the variance of what the transport does not hold of f, under a light (P,).

    At unit prior scale, for each prior component: shape (components,). White is always held.
    """
    projector = transport.projector
    spectrum = np.abs(np.fft.fft2(light.reshape(projector).astype(np.float64))) ** 2
    spectrum[_is_held(transport)] = 0.0
    # Far-range light has no detail that is finer than the coarsest functions.
    cycles = [np.fft.fftfreq(side) for side in projector]
    sampled = [np.flatnonzero(np.abs(one) <= 0.5 / transport.pitch) for one in cycles]
    spectrum = spectrum[np.ix_(*sampled)]
    down, across = (
        side * one[kept] for side, one, kept in zip(projector, cycles, sampled, strict=True)
    )
    radius = np.hypot(down[:, None], across)
    held = _held_cycles(transport)
    total = [np.sum(_expected_density(radius, one, held) * spectrum) for one in prior_components]
    return np.array(total) / projector.pixels**2


class Rows(NamedTuple):
    """Priors of all rows, the noise of their responses, and which frequencies were measured.

    Attributes
    ----------
    component : ndarray of int, shape (C,)
        The prior component of each camera pixel.
    squared_scale : ndarray, shape (C, channels)
        Square of its prior scale, photo units.
    squared_noise : ndarray, shape (C, channels)
        Variance of a measured response.
    multiplicity : ndarray, shape (Py, Px)
        How often the response to each frequency of the projector's DFT was measured; 0 where the
        transport holds none.
    """

    component: Integers
    squared_scale: Floats
    squared_noise: Floats
    multiplicity: Floats


def change_by_place(
    transport: Transport, light: Floats, prior_components: Sequence[PriorComponent], rows: Rows
) -> Callable[[slice], Floats]:
    """Return the correction of variances for where rows have light, under a light (P,).

    It is 0 where near-range functions are wider than a projector pixel: rows of such projectors are
    too long to be computed for each light.

    Returns
    -------
    callable
        A function of a block of camera pixels, which returns corrections, (n, channels): a squared
        error bar is the variance plus its correction.
    """
    if transport.pitch > 1:
        return lambda batch: np.zeros(rows.squared_scale[batch].shape)
    kind, densities = _unknown_densities(transport, prior_components, rows)
    shares = _by_pixel(transport, light, densities)
    totals = shares.sum(axis=1)
    # How many projector pixels share the variance.
    numbers = np.maximum(totals, TINY) ** 2 / np.maximum((shares**2).sum(axis=1), TINY**2)
    drawn = shares.reshape(-1, *transport.projector)
    about = gaussian_filter(drawn, (0, ABOUT, ABOUT), mode="wrap").reshape(shares.shape)
    of_entry = np.array([one.sum() for one in densities]) / transport.projector.pixels**2
    far = transport.far.reshape(transport.camera.pixels, transport.channels, -1)

    def relative(some: Floats, chosen: Integers, squared_scale: Floats) -> Floats:
        """Return squared error bars over the squared prior scale, (n,)."""
        power, variance, kurtosis = _power_of_rows(transport, some)
        local = np.empty(len(chosen))
        for place in np.unique(chosen):
            alike = chosen == place
            local[alike] = power[alike] @ about[place]
        local = EVERYWHERE * totals[chosen] + (1 - EVERYWHERE) * local
        unknown = of_entry[chosen] * squared_scale.sum(axis=1)
        unknown /= np.maximum(unknown + variance, TINY)
        excess = np.maximum(kurtosis - EVEN_KURTOSIS, 0.0) / numbers[chosen]
        return np.asarray(local * _narrowing(excess, unknown) ** 2)

    def of_pixels(batch: slice) -> Floats:
        squared_scale, chosen = rows.squared_scale[batch], kind[batch]
        found = np.zeros(squared_scale.shape)
        if not totals[chosen].any():
            return found
        held = far[batch]
        step = max(1, VALUES_AT_ONCE // (transport.channels * transport.projector.pixels))
        for some in blocks(len(chosen), step):
            mine = chosen[some]
            change = relative(held[some], mine, squared_scale[some]) - totals[mine]
            found[some] = squared_scale[some] * change[:, None]
        return found

    return of_pixels


def share_missed(
    transport: Transport, prior_components: Sequence[PriorComponent], rows: Rows
) -> Floats:
    """Return the share of far-range light's variance that the estimate misses, (C,)."""
    kind, densities = _unknown_densities(transport, prior_components, rows)
    unmeasured = rows._replace(multiplicity=np.zeros(transport.projector))
    _, expected = _unknown_densities(transport, prior_components, unmeasured)
    share = [
        one.sum() / all_of_it.sum() for one, all_of_it in zip(densities, expected, strict=True)
    ]
    return np.array(share)[kind]


def _unknown_densities(
    transport: Transport, prior_components: Sequence[PriorComponent], rows: Rows
) -> tuple[Integers, list[Floats]]:
    """Return which density each row has, (C,), and the densities, each (Py, Px)."""
    ratio = rows.squared_scale.mean(axis=1) / np.maximum(rows.squared_noise.mean(axis=1), TINY)
    octave = np.clip(np.rint(np.log2(np.maximum(ratio, TINY))), *OCTAVES)
    kinds, kind = np.unique(np.stack([rows.component, octave]), axis=1, return_inverse=True)
    held = _held_cycles(transport)
    densities = [
        _unknown_density(
            held,
            prior_components[int(place)],
            2.0**power if power < OCTAVES[1] else np.inf,
            rows.multiplicity,
        )
        for place, power in kinds.T
    ]
    return kind.ravel(), densities


def _unknown_density(
    held: Floats, prior_component: PriorComponent, ratio: float, multiplicity: Floats
) -> Floats:
    """Return the spectral density of what an estimate misses at unit prior scale, (Py, Px).

    At frequencies that the transport does not hold it is the prior's, at others the bias that
    shrinkage leaves: S / (1 + s^2 m S / sigma^2)^2, measured m times.
    """
    projector = Size(*multiplicity.shape)
    density = _expected_density(_cycles(projector), prior_component, held)
    density[0, 0] = 0.0
    # A cosine and a sine share the density of a pair.
    told = 0.5 * multiplicity * density
    told = np.multiply(told, ratio, out=np.zeros(projector), where=told > 0)
    return np.asarray(density / (1.0 + told) ** 2)


def _expected_density(radius: Floats, prior_component: PriorComponent, held: Floats) -> Floats:
    """Return the spectral density of f at unit prior scale, with outlines that no photo shows.

    Parameters
    ----------
    radius : ndarray
        Distance of k from DC, in cycles per pattern grid.
    prior_component : PriorComponent
    held : ndarray, shape (n,)
        The same of the frequencies that the transport holds.
    """
    density = spectral_density(radius, prior_component)
    fades = prior_component.near_reach == 0.0 and prior_component.far_decay <= FADING
    if not fades or not len(held):
        return density
    # The squared prior scale at which a row with edges has the same power.
    its, with_edges = (spectral_density(held, one) for one in (prior_component, LIGHT_WITH_EDGES))
    alike = np.mean(its / with_edges)
    outlines = alike * spectral_density(radius, LIGHT_WITH_EDGES)
    return np.asarray((1 - WEIGHT_OF_OUTLINES) * density + WEIGHT_OF_OUTLINES * outlines)


def _by_pixel(transport: Transport, light: Floats, densities: Sequence[Floats]) -> Floats:
    """Return (h * l)(p)^2 at unit prior scale, for densities h_k^2: (densities, P)."""
    projector = transport.projector
    spectrum = np.fft.fft2(light.reshape(projector).astype(np.float64))
    spectrum[np.abs(spectrum) <= ROUNDING * np.abs(light).sum()] = 0.0
    if not spectrum.any():
        return np.zeros((len(densities), projector.pixels))
    drawn = [np.fft.ifft2(np.sqrt(one) * spectrum).real for one in densities]
    return np.stack(drawn).reshape(-1, projector.pixels) ** 2 / projector.pixels


def _power_of_rows(transport: Transport, far: Floats) -> tuple[Floats, Floats, Floats]:
    """Return how the power of rows of F is distributed, all channels together.

    Returns
    -------
    power : ndarray, shape (n, P)
        Squares over their mean; 1 in dark rows.
    variance : ndarray, shape (n,)
        Mean square of what differs from the mean of a row, squares of photo units.
    kurtosis : ndarray, shape (n,)
        Mean square of `power`.
    """
    rows = transport.far_basis.synthesise(far)
    power = np.einsum("ncp,ncp->np", rows, rows)
    mean = power.mean(axis=1, keepdims=True)
    power = np.divide(power, mean, out=np.ones_like(power), where=mean > 0)
    variance = np.maximum(mean[:, 0] - (rows.mean(axis=2) ** 2).sum(axis=1), 0.0)
    return power, variance, np.einsum("np,np->n", power, power) / power.shape[1]


def _narrowing(excess: Floats, unknown: Floats) -> Floats:
    """Return half the width of an interval that holds 68 % of errors, in standard deviations.

    Parameters
    ----------
    excess : ndarray, shape (n,)
        Excess kurtosis of a row, over the number of projector pixels that share the variance.
    unknown : ndarray, shape (n,)
        Share of a row's variance that is not known.
    """
    sparse = 1 - np.exp(-((excess / SPARSE_EXCESS) ** 2))
    return np.asarray(1 - NARROWED * unknown * sparse)


def _cycles(projector: Size) -> Floats:
    """Return the distance from DC of the projector's frequencies, in cycles, (Py, Px)."""
    down, across = (side * np.fft.fftfreq(side) for side in projector)
    return np.asarray(np.hypot(down[:, None], across))


def _held_cycles(transport: Transport) -> Floats:
    """Return that of the frequencies that the transport holds, without DC, (n,)."""
    radius = _cycles(transport.projector)[_is_held(transport)]
    return np.asarray(radius[radius > 0])


def _is_held(transport: Transport) -> Booleans:
    """Return which frequencies of the projector's DFT the transport holds, (Py, Px)."""
    projector = transport.projector
    held = np.zeros(projector, dtype=bool)
    for k in (DC, *transport.far_basis.frequencies):
        y, x = (round(part * side) for part, side in zip(k, projector, strict=True))
        held[y % projector.height, x % projector.width] = True
        held[-y % projector.height, -x % projector.width] = True
    return held
