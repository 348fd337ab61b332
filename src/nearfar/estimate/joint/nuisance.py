"""Amplitudes besides n and f that responses depend on: o, d, shifts of q, and spikes.

o is the error that the references add to every response; d is direct light at q, and with it go how
far q is off down and across, times d; d2 ... are spikes, direct light of other surfaces at single
window entries. The responses to a unit amplitude are the same for all camera pixels but for
re-centring. An amplitude whose responses are 0 for a whole batch is left out.

Their prior precision follows from the references' noise, from direct light being about as bright as
white at most, and from how well q is found.

Index convention: arrays are (n, channels, ...); g and h run over amplitudes, r over responses.
"""

from array_api_compat import device

from nearfar.arrays import Floats, namespace, product
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.illumination.near_basis import NearBasis
from nearfar.priors.responses import ResponsePrior

# Prior standard deviation of direct light, as a share of white: wide enough not to bias d.
DIRECT_PRIOR_DEVIATION = 4.0
# Prior standard deviation of q, in projector pixels, times direct light as a share of white. Under
# a random light of cornell-aside at 58, 234 and 468 photos 0.015 gives 45.3, 48.3 and 49.3 dB,
# 0.008 45.1, 49.2 and 50.5, no shift 44.5, 48.5 and 50.1: where no prior component fits well, q
# must not move to make up for it.
SHIFT_DEVIATION = 0.008
# The same where the functions of near-range light are of several projector pixels, and frequencies
# up to 0.4 cycles a pixel tell q from them. At 256x256, 0.05 instead of 0.008 gains 6.8 dB under a
# random light on the corner, and 2 dB under pictures; 0.2 gains no more.
SHIFT_DEVIATION_AT_PITCH = 0.05
# o, d and two shifts: the amplitudes that every camera pixel has, before those of spikes.
COMMON_AMPLITUDES = 4
# References without noise still need a finite precision: their least deviation, as a share of
# white.
OFFSET_DEVIATION_FLOOR = 1e-12


def amplitude_responses(batch: PixelBatch, centred: CentredBasis) -> Floats:
    """Return responses a_g to unit o, d, shifts, d2 ..., without those left out: (n, G, R)."""
    return _side_by_side(
        [
            batch.of_offset,
            centred.of_direct(batch.direct_weights),
            centred.on_window.T[batch.spikes],
        ]
    )


def projected_amplitude_responses(batch: PixelBatch, prior: ResponsePrior) -> Floats:
    """Return the responses to unit amplitudes, projected onto a prior's eigenvectors, (n, G, R)."""
    return _side_by_side(
        [
            product(batch.of_offset, prior.eigenvectors),
            product(batch.direct_weights, prior.of_footprint),
            prior.of_window[batch.spikes],
        ]
    )


def _side_by_side(parts: list[Floats]) -> Floats:
    found: Floats = namespace(parts[0]).concat(parts, axis=1)
    return found


def prior_precision(batch: PixelBatch, near_basis: NearBasis) -> Floats:
    """Return the prior precision of the amplitudes not left out, (n, channels, G), float64."""
    common = common_precision(batch.white, batch.offset_noise, shift_deviation(near_basis))
    spikes = [1] * batch.spikes.shape[1]
    return common[..., _amplitude_indices(batch) + spikes]


def shift_deviation(near_basis: NearBasis) -> float:
    """Return the prior standard deviation of q, times direct light as a share of white."""
    return SHIFT_DEVIATION if near_basis.pitch == 1 else SHIFT_DEVIATION_AT_PITCH


def common_precision(white: Floats, offset_noise: Floats, shift_deviation: float) -> Floats:
    """Return the prior precision of o, d and shifts, (n, channels, 4), float64.

    Parameters
    ----------
    white, offset_noise : ndarray, shape (n, channels)
        As in `PixelBatch`.
    shift_deviation : float
        What the function of that name returns.
    """
    xp = namespace(white)
    white = xp.astype(white, xp.float64)
    deviation = xp.maximum(xp.astype(offset_noise, xp.float64), OFFSET_DEVIATION_FLOOR * white)
    offset = 1.0 / deviation**2
    direct = 1.0 / (DIRECT_PRIOR_DEVIATION * white) ** 2
    shift = 1.0 / (shift_deviation * white) ** 2
    found: Floats = xp.stack([offset, direct, shift, shift], axis=-1)
    return found


def in_full(amplitudes: Floats, batch: PixelBatch) -> Floats:
    """Return o, d, two shifts, d2 ..., with 0 for those left out, float32."""
    indices = _amplitude_indices(batch)
    xp = namespace(amplitudes)
    shape = (*amplitudes.shape[:2], COMMON_AMPLITUDES + batch.spikes.shape[1])
    found: Floats = xp.zeros(shape, dtype=xp.float32, device=device(amplitudes))
    spikes = list(range(COMMON_AMPLITUDES, shape[-1]))
    found[..., indices + spikes] = xp.astype(amplitudes, xp.float32)
    return found


def _amplitude_indices(batch: PixelBatch) -> list[int]:
    """Return the indices of the amplitudes o, d and shifts that are not left out."""
    offset = [0] if batch.of_offset.shape[1] else []
    return offset + list(range(1, 1 + batch.direct_weights.shape[1]))


def solve(normal: Floats, right: Floats, precision: Floats) -> Floats:
    """Solve (normal + diag(precision)) x = right, float64.

    Parameters
    ----------
    normal : ndarray, shape (n, channels, G, G)
    right, precision : ndarray, shape (n, channels, G)
    """
    xp = namespace(normal)
    found: Floats = xp.linalg.solve(regularised(normal, precision), right[..., None])[..., 0]
    return found


def regularised(normal: Floats, precision: Floats) -> Floats:
    """Return normal + diag(precision), (n, channels, G, G); see `solve`."""
    xp = namespace(normal)
    unit = xp.eye(precision.shape[-1], dtype=precision.dtype, device=device(precision))
    found: Floats = normal + precision[..., None] * unit
    return found
