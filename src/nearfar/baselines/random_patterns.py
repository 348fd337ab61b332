"""Random patterns, and the response of every camera pixel to them: b = T l.

Index convention: k runs over K patterns.
"""

from dataclasses import dataclass

import numpy as np

from nearfar.arrays import Booleans, Floats, Size, blocks
from nearfar.errors import InputError
from nearfar.rigs.base import Rig
from nearfar.transport.exact import ExactTransport

# Patterns displayed to a known transport at once.
PATTERNS_AT_ONCE = 32


def bernoulli_patterns(projector: Size, count: int, seed: int) -> Booleans:
    """Draw patterns whose pixels are white or black with probability 1/2 each.

    Parameters
    ----------
    projector : Size
    count : int
        K, at least 1.
    seed : int

    Returns
    -------
    ndarray of bool, shape (K, Py, Px)

    Raises
    ------
    InputError
        If there is no pattern to draw.
    """
    if count < 1:
        raise InputError(f"{count} random patterns measure nothing: ask for at least 1.")
    generator = np.random.default_rng([seed, 2009])
    return np.asarray(generator.integers(0, 2, size=(count, *projector), dtype=np.uint8) > 0)


@dataclass(frozen=True, eq=False)
class CompressiveMeasurements:
    """Responses of every camera pixel to random patterns.

    Attributes
    ----------
    camera : Size
    patterns : ndarray of bool, shape (K, Py, Px)
    responses : ndarray, shape (C, channels, K), float32
        b in photo units, black subtracted.
    photos : int
        Exposures that were needed: K, and 1 for black where a rig was used.
    name : str
        What was measured.
    """

    camera: Size
    patterns: Booleans
    responses: Floats
    photos: int
    name: str = "compressive light transport"

    def __post_init__(self) -> None:
        if self.responses.ndim != 3 or (self.responses.shape[0], self.responses.shape[2]) != (
            self.camera.pixels,
            len(self.patterns),
        ):
            raise InputError(
                f"responses of shape {self.responses.shape} do not fit a camera of {self.camera} "
                f"and {len(self.patterns)} patterns: give (camera pixels, channels, patterns)."
            )
        if not self.patterns.any():
            raise InputError("all patterns are black, which measures nothing: draw others.")

    @property
    def projector(self) -> Size:
        """Pattern grid."""
        return Size(*self.patterns.shape[1:])

    @property
    def rows(self) -> Floats:
        """Responses as rows, shape (C * channels, K)."""
        return self.responses.reshape(-1, len(self.patterns))


def measure_without_noise(truth: ExactTransport, patterns: Booleans) -> CompressiveMeasurements:
    """Measure a known transport without noise, black level or quantisation: b = T l.

    Parameters
    ----------
    truth : ExactTransport
    patterns : ndarray of bool, shape (K, Py, Px)

    Raises
    ------
    InputError
        If the patterns are not of the projector's size.
    """
    responses = np.empty((len(patterns), truth.camera.pixels, truth.channels), dtype=np.float32)
    for block in blocks(len(patterns), PATTERNS_AT_ONCE):
        pictures = truth.pictures(patterns[block].astype(np.float32))
        responses[block] = pictures.reshape(-1, *responses.shape[1:])
    return CompressiveMeasurements(
        truth.camera, patterns, np.moveaxis(responses, 0, 2).copy(), len(patterns), truth.name
    )


def measure_by_rig(rig: Rig, patterns: Booleans) -> CompressiveMeasurements:
    """Measure responses on a rig: project the patterns, and black once to subtract.

    Parameters
    ----------
    rig : Rig
    patterns : ndarray of bool, shape (K, Py, Px)

    Raises
    ------
    InputError
        If the patterns are not of the projector's size.
    """
    if patterns.shape[1:] != rig.projector:
        raise InputError(
            f"the patterns are {Size(*patterns.shape[1:])}, the rig's projector is "
            f"{rig.projector}: draw them of its size."
        )
    displayed = (
        255 * pattern.astype(np.uint8) for pattern in (np.zeros(rig.projector, bool), *patterns)
    )
    photos = rig.shoot(displayed)
    black = next(photos).astype(np.float32)
    camera = Size(*black.shape[:2])
    responses = np.empty((len(patterns), camera.pixels, black.shape[2]), dtype=np.float32)
    for k, photo in enumerate(photos):
        responses[k] = (photo - black).reshape(responses.shape[1:]) / np.float32(rig.full_scale)
    return CompressiveMeasurements(
        camera, patterns, np.moveaxis(responses, 0, 2).copy(), len(patterns) + 1
    )
