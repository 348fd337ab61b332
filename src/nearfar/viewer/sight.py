"""What a photo tells of aim, focus and exposure, at a glance.

Index convention: photos are (Cy, Cx, channels), raw levels.
"""

from typing import Any, NamedTuple

import imagecodecs
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.files import to_srgb

BINS = 64
# The picture in the browser is this wide at most.
WIDEST = 960
# A value this close to full scale counts as saturated.
FULL = 0.999
# Saturated camera pixels are shown so: red, which no scene is.
MARK = (255, 0, 60)
QUALITY = 88


class Sight(NamedTuple):
    """What is told of a photo.

    Attributes
    ----------
    histogram : list of list of int
        Values in each of `BINS` even steps up to full scale, channel by channel.
    saturated : float
        Share of values at full scale.
    brightest : float
        Level that one value in a thousand exceeds, over full scale.
    mean : float
        Over full scale.
    focus : float
        Contrast from pixel to pixel in the middle of the photo over its mean light; larger is
        sharper, for one scene and one light.
    """

    histogram: list[list[int]]
    saturated: float
    brightest: float
    mean: float
    focus: float


def look(photo: NDArray[Any], full_scale: float) -> Sight:
    """Tell aim, focus and exposure of a photo.

    Parameters
    ----------
    photo : array, shape (Cy, Cx, channels)
    full_scale : float

    Returns
    -------
    Sight
    """
    share = photo.astype(np.float32) / np.float32(full_scale)
    bins = np.clip((share * BINS).astype(np.int64), 0, BINS - 1)
    histogram = [
        np.bincount(channel.reshape(-1), minlength=BINS).tolist()
        for channel in np.moveaxis(bins, -1, 0)
    ]
    return Sight(
        histogram=histogram,
        saturated=float((share >= FULL).mean()),
        brightest=float(np.quantile(share, 0.999)),
        mean=float(share.mean(dtype=np.float64)),
        focus=_focus(share.mean(axis=-1)),
    )


def picture(photo: NDArray[Any], full_scale: float) -> bytes:
    """Encode a photo for the browser: JPEG, sRGB, saturated camera pixels marked.

    Parameters
    ----------
    photo : array, shape (Cy, Cx, channels)
    full_scale : float
    """
    step = -(-photo.shape[1] // WIDEST)
    share = photo[::step, ::step].astype(np.float32) / np.float32(full_scale)
    shown = np.rint(255 * to_srgb(np.clip(share, 0, 1))).astype(np.uint8)
    if shown.shape[-1] != 3:
        shown = np.repeat(shown[..., :1], 3, axis=-1)
    shown[(share >= FULL).any(axis=-1)] = MARK
    return bytes(imagecodecs.jpeg8_encode(np.ascontiguousarray(shown), level=QUALITY))


def _focus(light: NDArray[np.float32]) -> float:
    height, width = light.shape
    middle = light[height // 4 : height - height // 4, width // 4 : width - width // 4]
    mean = float(middle.mean())
    return float(ndimage.laplace(middle).std()) / mean if mean > 0 else 0.0
