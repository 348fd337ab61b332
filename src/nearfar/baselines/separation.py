"""Direct and global light under floodlight from a few high-frequency patterns.

After Nayar, Krishnan, Grossberg and Raskar, SIGGRAPH 2006, sections 3 and 4. A pattern that is
white on half of the projector pixels, and fine against how the global light varies, lights every
camera pixel with half of its global light, and with all or none of its direct light. Let D and G
be a camera pixel's direct and global light under white less black, b the light of a black pixel
as a share of a white one's, and B = b / (1 - b) the same in units of white less black. Then, with
the projector's pixel lit (+) or not (-), and without ambient light,

    L+ = (1 + B) D + (1/2 + B) G,    L- = B D + (1/2 + B) G,

which is the paper's L+ = L_d + (1 + b) L_g / 2, L- = b L_d + (1 + b) L_g / 2 (its equation 7, half
of the pixels lit) with L_d = (1 + B) D and L_g = (1 + B) G, the light under full white, the
projector's own black included. Photos less the *ambient* light alone (projector covered or off)
have these values. Photos less the photo *under black* have B (D + G) less, and b = 0 serves
whatever the projector's black is: the better way where black can be projected.

Index convention: photos are (n, Cy, Cx, channels) in photo units, n in the order of the patterns;
pictures are (Cy, Cx, channels). Channels of a camera pixel see the same projector pixels, so what
is chosen by brightness is chosen once for all of them, by their sum: noise then chooses less.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.errors import InputError

# Of a camera pixel's samples, those under this share of the largest are taken to straddle an edge
# of the pattern. Chosen where both kinds of camera pixels do well (benchmarks/separation.py).
STRADDLING_SHARE = 0.7


class Separation(NamedTuple):
    """Pictures under full white, (Cy, Cx, channels), float32, in photo units.

    Their sum is photo(white) - photo(black).
    """

    direct: Floats
    global_: Floats


def separate_by_extremes(photos: Floats, black_level: float = 0.0) -> Separation:
    """Separate by the brightest and the darkest photo of each camera pixel.

    The paper's own formula, for any patterns that are half lit and fine, known or not:
    D = L+ - L-, G = (L- - B D) / (1/2 + B). The largest of noisy values is too large and the
    smallest too small, so D is too bright and G too dark, the more the more photos there are; so
    are camera pixels whose near surroundings differ in the two photos. Where the patterns are
    known, `separate_by_pairs` is better by up to 12 dB, `separate_by_phase` by more.

    Parameters
    ----------
    photos : ndarray, shape (n, Cy, Cx, channels), n >= 2
        Less the ambient light, or less the photo under black.
    black_level : float
        b, light of a black pixel as a share of a white one's; 0 for photos less that under black.

    Returns
    -------
    Separation

    Raises
    ------
    InputError
        If there are too few photos or the black level is outside [0, 1).
    """
    dark = black_over_white_less_black(black_level)
    _require(photos, 2)
    brightness = photos.sum(axis=-1, keepdims=True)
    highest, lowest = (
        np.take_along_axis(photos, chosen[None], axis=0)[0]
        for chosen in (brightness.argmax(axis=0), brightness.argmin(axis=0))
    )
    direct = highest - lowest
    return _pictures(direct, (lowest - dark * direct) / (0.5 + dark))


def separate_by_pairs(photos: Floats, black_level: float = 0.0) -> Separation:
    """Separate by the differences and sums of photos under patterns and their inverses.

    A difference is D or -D, and smaller where the camera pixel straddles an edge of the pattern.
    D is the mean of the larger ones (see `STRADDLING_SHARE`). The mean takes out noise, and near
    light that is part of a difference in some photos and not in others. All sums are
    (1 + 2 B) (D + G): their mean less D gives G, with next to no noise of its own.

    Parameters
    ----------
    photos : ndarray, shape (2 n, Cy, Cx, channels)
        Photo 2 j + 1 under the inverse of the pattern of photo 2 j, as `checkerboards` gives
        them; less the ambient light, or less the photo under black.
    black_level : float
        As for `separate_by_extremes`.

    Returns
    -------
    Separation

    Raises
    ------
    InputError
        If photos do not pair or the black level is outside [0, 1).
    """
    dark = black_over_white_less_black(black_level)
    _require(photos, 2, multiple=2)
    return _from_samples(photos[::2] - photos[1::2], photos, dark)


def separate_by_phase(photos: Floats, shifts: int, black_level: float = 0.0) -> Separation:
    """Separate by the least-squares fit of offset and amplitude to shifted sinusoids.

    Photo j of an axis is o + a cos(theta + 2 pi j / shifts); with equally spaced phases the fit
    is the discrete Fourier transform over j. a = D / 2 and o = (1/2 + B) (D + G). The phase theta
    is that of all channels together, and each channel's amplitude is taken at that phase: a
    modulus would be too large under noise. D is the mean over the axes along which the camera pixel
    does not straddle an edge (see `STRADDLING_SHARE`).

    Parameters
    ----------
    photos : ndarray, shape (axes * shifts, Cy, Cx, channels)
        As `sinusoids` gives them, all phases along y, then along x; less the ambient light, or
        less the photo under black.
    shifts : int
        Number of phases, at least 3.
    black_level : float
        As for `separate_by_extremes`.

    Returns
    -------
    Separation

    Raises
    ------
    InputError
        If the number of photos does not fit the shifts, there are too few shifts, or the black
        level is outside [0, 1).
    """
    dark = black_over_white_less_black(black_level)
    if shifts < 3:
        raise InputError(f"{shifts} shifts cannot tell offset and amplitude apart: give 3 or more.")
    _require(photos, shifts, multiple=shifts)
    # Twice the amplitude, in the photos' own precision.
    weights = (4 / shifts) * np.exp(-2j * np.pi * np.arange(shifts) / shifts)
    weights = weights.astype(np.result_type(photos.dtype, np.complex64))
    by_axis = photos.reshape(-1, shifts, *photos.shape[1:])
    fitted = np.einsum("j,ajyxi->ayxi", weights, by_axis)
    together = fitted.sum(axis=-1, keepdims=True)
    modulus = np.maximum(np.abs(together), np.finfo(photos.dtype).tiny)
    return _from_samples((fitted * together.conj() / modulus).real, photos, dark)


def black_over_white_less_black(black_level: float) -> float:
    """Return B = b / (1 - b), a black pixel's light in units of white less black.

    Raises
    ------
    InputError
        If b is outside [0, 1).
    """
    if not 0.0 <= black_level < 1.0:
        raise InputError(
            f"the black level {black_level:g} is no share of white's light: give 0 or more, and "
            f"less than 1."
        )
    return black_level / (1.0 - black_level)


def direct_of_samples(samples: Floats) -> Floats:
    """Return direct light from samples of +-D, (n, Cy, Cx, channels): the mean of the larger ones.

    Samples under `STRADDLING_SHARE` of a camera pixel's largest straddle an edge, and are left out.
    """
    together = samples.sum(axis=-1, keepdims=True)
    size = np.abs(together)
    # Where all is black every sample counts.
    chosen = size >= STRADDLING_SHARE * size.max(axis=0)
    signs = np.where(together < 0, -1, 1) * chosen
    return np.asarray((signs * samples).sum(axis=0) / chosen.sum(axis=0))


def _from_samples(samples: Floats, photos: Floats, dark: float) -> Separation:
    """Turn samples of +-D (n, Cy, Cx, channels) and half-lit photos into direct and global."""
    direct = direct_of_samples(samples)
    return _pictures(direct, photos.mean(axis=0) / (0.5 + dark) - direct)


def _pictures(direct: Floats, global_: Floats) -> Separation:
    def single(picture: Floats) -> NDArray[np.float32]:
        return np.ascontiguousarray(picture, dtype=np.float32)

    return Separation(single(direct), single(global_))


def _require(photos: Floats, least: int, *, multiple: int = 1) -> None:
    if photos.ndim != 4 or photos.dtype.kind != "f":
        raise InputError(
            f"the photos are an array of {photos.dtype} and shape {photos.shape}: give floats, "
            f"photos x height x width x channels."
        )
    if len(photos) < least or len(photos) % multiple:
        group = f"a multiple of {multiple}" if multiple > 1 else f"{least} or more"
        raise InputError(f"there are {len(photos)} photos to separate: give {group}.")
