"""What responses besides n and f: o, d, shifts of q, and direct light of other surfaces.

o is the error that the references add to every answer; d is direct light at q, and with it go how
far q is off down and across, times d; d2 ... are spikes of direct light at single window entries.
Their responses are combinations of a few vectors that all camera pixels share, but for o's. Where
no camera pixel of a block can tell one of them, it is left out.

Their precision is known beforehand: the references' noise, that direct light is about as bright as
white at most, and that q was found well.

Index convention: arrays are (n, channels, ...); g and h run over the numbers, r over responses.
"""

from array_api_compat import device

from nearfar.arrays import Floats, namespace, product
from nearfar.estimate.joint.pixels import Pixels
from nearfar.estimate.joint.prior import Prior
from nearfar.estimate.matrices import Band

# Deviation of direct light expected beforehand, as a share of white: no opinion.
UNKNOWN = 4.0
# Deviation of q, in projector pixels, times direct light as a share of white. Under a random light
# of cornell-aside at 58, 234 and 468 photos 0.015 gives 45.3, 48.3 and 49.3 dB, 0.008 45.1, 49.2
# and 50.5, none 44.5, 48.5 and 50.1: where no kind fits well, q must not move to make up for it.
OFF = 0.008
# All numbers but those of second surfaces.
KEPT = 4
# References that cannot err still need a number.
LEAST = 1e-12


def columns(pixels: Pixels, band: Band) -> Floats:
    """Return responses a_g of unit o, d, shifts, d2 ..., those that are there: (n, G, R)."""
    return _side_by_side(
        [
            pixels.of_offset,
            product(pixels.corners, band.on_corners.T),
            band.on_window.T[pixels.spikes],
        ]
    )


def turned(pixels: Pixels, prior: Prior) -> Floats:
    """Return the same in the coordinates of a kind's eigenvectors."""
    return _side_by_side(
        [
            product(pixels.of_offset, prior.directions),
            product(pixels.corners, prior.of_corners),
            prior.of_window[pixels.spikes],
        ]
    )


def _side_by_side(parts: list[Floats]) -> Floats:
    found: Floats = namespace(parts[0]).concat(parts, axis=1)
    return found


def precision(pixels: Pixels) -> Floats:
    """Precision, before any answer, of those that are there, shape (n, channels, G), float64."""
    known = precision_of(pixels.white, pixels.offset_noise)
    direct = [1] * pixels.spikes.shape[1]
    return known[..., _places(pixels) + direct]


def precision_of(white: Floats, offset_noise: Floats) -> Floats:
    """Precision of o, d and shifts, for arrays (n, channels) as in `Pixels`."""
    xp = namespace(white)
    white = xp.astype(white, xp.float64)
    offset = 1.0 / xp.maximum(xp.astype(offset_noise, xp.float64), LEAST * white) ** 2
    direct = 1.0 / (UNKNOWN * white) ** 2
    shift = 1.0 / (OFF * white) ** 2
    found: Floats = xp.stack([offset, direct, shift, shift], axis=-1)
    return found


def laid_out(shared: Floats, pixels: Pixels) -> Floats:
    """Lay numbers out as o, d, two shifts, d2 ...: 0 for those that are not there, float32."""
    places = _places(pixels)
    xp, shape = namespace(shared), (*shared.shape[:2], KEPT + pixels.spikes.shape[1])
    found: Floats = xp.zeros(shape, dtype=xp.float32, device=device(shared))
    spikes = list(range(KEPT, shape[-1]))
    found[..., places + spikes] = xp.astype(shared, xp.float32)
    return found


def _places(pixels: Pixels) -> list[int]:
    """Tell which of o, d and the shifts are there."""
    offset = [0] if pixels.of_offset.shape[1] else []
    return offset + list(range(1, 1 + pixels.corners.shape[1]))


def solve(normal: Floats, right: Floats, known: Floats) -> Floats:
    """Solve (normal + diag(known)) x = right, float64.

    Parameters
    ----------
    normal : ndarray, shape (n, channels, G, G)
    right, known : ndarray, shape (n, channels, G)
    """
    xp = namespace(normal)
    unit = xp.eye(known.shape[-1], dtype=known.dtype, device=device(known))
    found: Floats = xp.linalg.solve(normal + known[..., None] * unit, right[..., None])[..., 0]
    return found
