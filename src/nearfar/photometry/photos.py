"""Parts that measuring by pairs and by reference share: batches of photos, places, levels.

Index convention: arrays are (photos, C, channels) with C camera pixels row by row; r runs over
real responses.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, blocks
from nearfar.errors import InputError
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.real_basis import RealBasis, real_basis
from nearfar.parallel import ahead
from nearfar.photometry.noise import NoiseModel, variance_by_channel
from nearfar.plan import Plan, Sinusoid, Stripe

# Photos read at once.
PHOTOS_AT_ONCE = 16
# Bytes that photos read at once take at most, but for a single one.
BATCH_BYTES = 2**26
FLOAT32_BYTES = 4

# A wave: a frequency, and whether it is the sine and not the cosine.
Wave = tuple[Frequency, bool]


class Photos(Protocol):
    """Photos of a plan in photo units (full scale = 1), wherever they are stored."""

    @property
    def plan(self) -> Plan:
        """The plan that was shot."""
        ...

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        ...

    @property
    def channels(self) -> int:
        """Channels of the photos."""
        ...

    def read(self, indices: Sequence[int], rows: slice) -> Floats:
        """Photos `indices` as float32, (n, len(rows), Cx, channels)."""
        ...


@dataclass(frozen=True, eq=False)
class PhotosWithNoise:
    """Photos of a plan with a model of their noise; read as any others.

    Attributes
    ----------
    photos : Photos
        As they were taken.
    noise : tuple of NoiseModel
        One for each channel.
    """

    photos: Photos
    noise: tuple[NoiseModel, ...]

    @property
    def plan(self) -> Plan:
        """The plan that was shot."""
        return self.photos.plan

    @property
    def camera(self) -> Size:
        """Height and width of the photos."""
        return self.photos.camera

    @property
    def channels(self) -> int:
        """Channels of the photos."""
        return self.photos.channels

    def read(self, indices: Sequence[int], rows: slice) -> Floats:
        """Photos `indices` as float32, (n, len(rows), Cx, channels)."""
        return self.photos.read(indices, rows)

    def variance(self, photo: Floats) -> Floats:
        """Variance of one photo that reads `photo`, (C, channels)."""
        return variance_by_channel(self.noise, photo)


def size_of_rows(photos: Photos, rows: slice) -> Size:
    """Return the size of some rows of the camera."""
    return Size(len(range(*rows.indices(photos.camera.height))), photos.camera.width)


def in_batches(
    photos: Photos, numbers: Sequence[int], rows: slice
) -> Iterator[tuple[Sequence[int], Floats]]:
    """Yield photo numbers and their photos, (n, C, channels), `PHOTOS_AT_ONCE` or fewer at once."""
    photo = FLOAT32_BYTES * size_of_rows(photos, rows).pixels * photos.channels
    count = max(1, min(PHOTOS_AT_ONCE, BATCH_BYTES // max(1, photo)))

    def read(mine: Sequence[int]) -> Floats:
        return photos.read(mine, rows).reshape(len(mine), -1, photos.channels)

    yield from ahead(read, [list(numbers[batch]) for batch in blocks(len(numbers), count)])


def mean_photo(photos: Photos, numbers: Sequence[int], rows: slice) -> NDArray[np.float64]:
    """Return the mean of photos, (C, channels)."""
    shape = (size_of_rows(photos, rows).pixels, photos.channels)
    total = np.zeros(shape)
    for _, read in in_batches(photos, numbers, rows):
        total += read.sum(axis=0, dtype=np.float64)
    return total / len(numbers)


def find_waves(plan: Plan) -> dict[Wave, list[tuple[int, int]]]:
    """List the photos of each cosine and sine, with their sign: -1 for inverses."""
    found: dict[Wave, list[tuple[int, int]]] = {}
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid):
            wave = (pattern.frequency, pattern.kind == "sine")
            found.setdefault(wave, []).append((number, -1 if pattern.inverse else 1))
    return found


def basis_of(responses: Sequence[Wave], projector: Size) -> tuple[RealBasis, dict[Wave, int]]:
    """Return the basis of the waves that were projected, and the place of each wave in it.

    Raises
    ------
    InputError
        If a cosine was projected without its sine, or a sine without its cosine.
    """
    known = set(responses)
    basis = real_basis(list(dict.fromkeys(frequency for frequency, _ in responses)), projector)
    place = {
        (basis.frequencies[i], bool(sine)): r
        for r, (i, sine) in enumerate(zip(basis.index, basis.is_sine, strict=True))
    }
    for frequency, sine in place:
        if (frequency, sine) not in known:
            raise InputError(
                f"the plan shows frequency ({frequency.fy}, {frequency.fx}) without its "
                f"{'sine' if sine else 'cosine'}, and both are one measurement: make the plan "
                f"again with both."
            )
    return basis, place


class Reference(NamedTuple):
    """A photo that is `blacks` x black + `lights` x (white - black), and its variance."""

    value: Floats
    blacks: float
    lights: float
    variance: Floats


def stripe_references(
    photos: Photos, rows: slice, variance: Callable[[Floats], Floats]
) -> list[Reference]:
    """Return the mean of all stripes of each axis, which is black + (1 - 1 / stripes) light."""
    found: list[Reference] = []
    for kind in ("black row", "black column"):
        numbers = [
            i
            for i, pattern in enumerate(photos.plan.patterns)
            if isinstance(pattern, Stripe) and pattern.kind == kind
        ]
        if numbers:
            mean, count = mean_photo(photos, numbers, rows), len(numbers)
            found.append(Reference(mean, 1.0, 1.0 - 1.0 / count, variance(mean) / count))
    return found


class Levels(NamedTuple):
    """Black, and light = white - black, with the variance of light and of white."""

    black: Floats
    light: Floats
    light_variance: Floats
    white_variance: Floats
    black_variance: Floats


def two_levels(references: Sequence[Reference]) -> Levels:
    """Weighted least squares for black and light = white - black, (C, channels)."""
    a11 = a12 = a22 = b1 = b2 = np.zeros(())
    for value, blacks, lights, variance in references:
        weight = 1.0 / np.maximum(variance, 1e-12)
        a11 = a11 + weight * blacks * blacks
        a12 = a12 + weight * blacks * lights
        a22 = a22 + weight * lights * lights
        b1 = b1 + weight * blacks * value
        b2 = b2 + weight * lights * value
    determinant = a11 * a22 - a12 * a12
    return Levels(
        black=(a22 * b1 - a12 * b2) / determinant,
        light=(a11 * b2 - a12 * b1) / determinant,
        light_variance=a11 / determinant,
        white_variance=(a11 + a22 - 2 * a12) / determinant,
        black_variance=a22 / determinant,
    )
