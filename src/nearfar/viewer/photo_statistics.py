"""Statistics of a photo that show aim, focus and exposure, and its picture for the preview.

Index convention: photos are (Cy, Cx, channels), raw levels.
"""

from typing import Any, NamedTuple

import imagecodecs
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from nearfar.files import to_srgb

HISTOGRAM_BINS = 64
# Larger photos are displayed at a fraction of their size.
MAXIMUM_DISPLAY_WIDTH = 960
# As a share of full scale.
SATURATION_LEVEL = 0.999
# A red that hardly occurs in scenes.
SATURATED_COLOUR = (255, 0, 60)
JPEG_QUALITY = 88
# The brightest value but for one in a thousand, so that a hot pixel does not count.
BRIGHTEST_QUANTILE = 0.999


class PhotoStatistics(NamedTuple):
    """Statistics of a photo.

    Attributes
    ----------
    histogram : list of list of int
        Number of values in each of `HISTOGRAM_BINS` even bins up to full scale, for each channel.
    saturated : float
        Share of values at full scale.
    brightest : float
        Level that one value in a thousand exceeds, as a share of full scale.
    mean : float
        As a share of full scale.
    focus : float
        Standard deviation of the Laplacian in the middle of the photo, divided by the mean there.
        Larger is sharper, as long as scene and light are the same.
    """

    histogram: list[list[int]]
    saturated: float
    brightest: float
    mean: float
    focus: float


def photo_statistics(photo: NDArray[Any], full_scale: float) -> PhotoStatistics:
    """Return the statistics of a photo.

    Parameters
    ----------
    photo : array, shape (Cy, Cx, channels)
    full_scale : float
    """
    share = photo.astype(np.float32) / np.float32(full_scale)
    bins = np.clip((share * HISTOGRAM_BINS).astype(np.int64), 0, HISTOGRAM_BINS - 1)
    histogram = [
        np.bincount(channel.reshape(-1), minlength=HISTOGRAM_BINS).tolist()
        for channel in np.moveaxis(bins, -1, 0)
    ]
    return PhotoStatistics(
        histogram=histogram,
        saturated=float((share >= SATURATION_LEVEL).mean()),
        brightest=float(np.quantile(share, BRIGHTEST_QUANTILE)),
        mean=float(share.mean(dtype=np.float64)),
        focus=_focus(share.mean(axis=-1)),
    )


def encode_for_display(photo: NDArray[Any], full_scale: float) -> bytes:
    """Return a photo as JPEG: sRGB, with saturated camera pixels in `SATURATED_COLOUR`.

    Parameters
    ----------
    photo : array, shape (Cy, Cx, channels)
    full_scale : float
    """
    stride = -(-photo.shape[1] // MAXIMUM_DISPLAY_WIDTH)
    share = photo[::stride, ::stride].astype(np.float32) / np.float32(full_scale)
    pixels = np.rint(255 * to_srgb(np.clip(share, 0, 1))).astype(np.uint8)
    if pixels.shape[-1] != 3:
        pixels = np.repeat(pixels[..., :1], 3, axis=-1)
    pixels[(share >= SATURATION_LEVEL).any(axis=-1)] = SATURATED_COLOUR
    return bytes(imagecodecs.jpeg8_encode(np.ascontiguousarray(pixels), level=JPEG_QUALITY))


def _focus(light: NDArray[np.float32]) -> float:
    height, width = light.shape
    middle = light[height // 4 : height - height // 4, width // 4 : width - width // 4]
    mean = float(middle.mean())
    return float(ndimage.laplace(middle).std()) / mean if mean > 0 else 0.0
