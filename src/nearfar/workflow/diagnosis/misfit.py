"""How photos differ from the pictures of the transport that was estimated from them.

The misfit of a photo is the mean over camera pixels of its squared difference from the relit
picture, divided by the variance that noise and a small error of the model give it: about 1 if all
is well.

The difference is also compared with what several causes would make of it, by weighted least
squares: another lamp or ambient light, a shift of camera or projector, another focus, a response
that is not linear. The normal equations of each photo are kept. Any model of how a cause develops
from photo to photo can be fitted to them afterwards.

Index convention: photos are (photos, rows, columns, channels) of a camera sample; normal equations
are (photos, regions, causes, causes) and (photos, regions, causes).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats, Integers, blocks
from nearfar.illumination.frequencies import DC
from nearfar.parallel import side_by_side
from nearfar.photometry.by_codes import find_codes
from nearfar.photometry.photos import Photos
from nearfar.plan import Plan, Sinusoid
from nearfar.plan.checks import is_reference
from nearfar.plan.patterns import HalfScreen, LampCode, Pattern, Picture
from nearfar.transport.model import Transport
from nearfar.workflow.diagnosis.sample import PATCH, CameraSample

# Error of the model that counts as noise, as a share of the camera pixel's white and of the mean's.
MODEL_ERROR = 0.002
MODEL_ERROR_OF_MEAN = 0.0005
# Smallest change of exposure, and of ambient light as a share of white, that is reported: errors of
# the model may look like smaller ones.
SMALLEST_CHANGE = 0.01
# Share of a change of light that is left of it in the sum of the photo and that of the inverse
# pattern.
LEAST_IN_SUM = 0.5
# Values of patterns that a thread draws at a time.
MOST_DRAWN = 2**24
# The picture is divided into as many regions down and across.
REGIONS_A_SIDE = 3

# Places of the causes in the normal equations.
(
    GAIN,
    OFFSET,
    DOWN,
    ACROSS,
    CAMERA_FOCUS,
    PROJECTOR_DOWN,
    PROJECTOR_ACROSS,
    PROJECTOR_FOCUS,
    BEND,
) = range(9)
CAUSES = 9
OF_PROJECTOR = slice(PROJECTOR_DOWN, PROJECTOR_FOCUS + 1)


class SteadyPhotos(Photos, Protocol):
    """Photos of a plan without the drift of the lamp, with a model of their noise."""

    @property
    def unsaturated(self) -> Booleans:
        """Where no photo of white is saturated, (Cy, Cx, channels)."""
        ...

    def variance(self, photo: Floats) -> Floats:
        """Variance of one photo that reads `photo`, (C, channels)."""
        ...

    def only(self, numbers: Integers) -> "SteadyPhotos":
        """Return some of the photos, in order, in memory."""
        ...


@dataclass(frozen=True, eq=False)
class Fits:
    """Photos of a sample beside their relit pictures.

    Attributes
    ----------
    photos, relit, variance : ndarray, shape (photos, rows, columns, channels)
        Without drift; relit pictures with the light of black; variance of their difference.
    black : ndarray, shape (rows, columns, channels)
    white : ndarray, shape (rows, columns, channels)
        Relit under white, without black.
    """

    photos: Floats
    relit: Floats
    variance: Floats
    black: Floats
    white: Floats

    @property
    def misfit(self) -> Floats:
        """Misfit of each photo, (photos,)."""
        return np.asarray(((self.photos - self.relit) ** 2 / self.variance).mean(axis=(1, 2, 3)))


@dataclass(frozen=True, eq=False)
class PhotoFits(Fits):
    """Photos of a sample beside their relit pictures, with the plan of the photos.

    Attributes
    ----------
    without_drift : SteadyPhotos
        The photos of the sample.
    """

    without_drift: SteadyPhotos

    @property
    def plan(self) -> Plan:
        """The plan of the photos."""
        return self.without_drift.plan

    @cached_property
    def inverses(self) -> dict[int, list[int]]:
        """Photos of the inverse pattern of each photo that has any."""
        found: dict[int, list[int]] = {}
        for number, inverse in inverse_photos(self.plan):
            found.setdefault(number, []).append(inverse)
        return found


def fit_photos(photos: SteadyPhotos, transport: Transport, start: int = 0) -> PhotoFits:
    """Relight a sample, or some rows of a camera, under every pattern of its plan.

    Camera pixels that are saturated under white have infinite variance. So have photos of stripes
    and Gray code: no response is estimated from them, so that they differ from their relit pictures
    by more than noise.

    Parameters
    ----------
    photos : SteadyPhotos
        All photos.
    transport : Transport
        Of the sample's camera pixels, or of the rows.
    start : int
        First of the rows.
    """
    rows = slice(start, start + transport.camera.height)
    size = (*transport.camera, transport.channels)
    numbers = range(len(photos.plan.patterns))
    relit = relight(photos.plan, transport, numbers)
    taken = photos.read(numbers, rows)
    white = np.asarray(
        transport @ np.ones(transport.projector, dtype=np.float32), dtype=np.float32
    ).reshape(size)
    variance = np.stack(
        [
            photos.variance(np.maximum(a, b).reshape(-1, size[2])).reshape(size)
            for a, b in zip(taken, relit, strict=True)
        ]
    )
    variance += model_variance(white)
    variance[:, ~photos.unsaturated[rows]] = np.inf
    variance[serves(photos.plan, "correspondence")] = np.inf
    return PhotoFits(
        photos=taken,
        relit=relit,
        variance=variance.astype(np.float32),
        black=transport.black,
        white=white,
        without_drift=photos,
    )


def model_variance(white: Floats) -> Floats:
    """Return the error of the model that counts as noise, given a picture under white."""
    return np.asarray((MODEL_ERROR * white) ** 2 + (MODEL_ERROR_OF_MEAN * white.mean()) ** 2)


def relight(plan: Plan, transport: Transport, numbers: Iterable[int]) -> Floats:
    """Relight under some patterns of a plan and add black, (n, rows, columns, channels)."""
    wanted = list(numbers)
    found = np.empty((len(wanted), *transport.camera, transport.channels), dtype=np.float32)

    def work(together: slice) -> None:
        drawn = np.stack([plan.draw(number) / np.float32(255) for number in wanted[together]])
        found[together] = transport.pictures(drawn)

    side_by_side(work, blocks(len(wanted), MOST_DRAWN // plan.projector.pixels))
    found += transport.black
    return found


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations of the regression of each photo's difference on the causes, by region.

    Attributes
    ----------
    matrix : ndarray, shape (photos, regions, causes, causes)
    vector : ndarray, shape (photos, regions, causes)
    values : int
        Values of a photo, over which its misfit is the mean.
    """

    matrix: NDArray[np.float64]
    vector: NDArray[np.float64]
    values: int

    @property
    def whole(self) -> "NormalEquations":
        """Normal equations of the whole picture as one region."""
        return NormalEquations(
            self.matrix.sum(axis=1, keepdims=True),
            self.vector.sum(axis=1, keepdims=True),
            self.values,
        )

    def without(self, photos: Booleans) -> "NormalEquations":
        """Return the equations with those of some photos, (photos,), set to zero."""
        matrix, vector = self.matrix.copy(), self.vector.copy()
        matrix[photos] = vector[photos] = 0.0
        return NormalEquations(matrix, vector, self.values)


def normal_equations(sample: CameraSample, fits: Fits) -> NormalEquations:
    """Return the normal equations of all photos of a sample."""
    plan = sample.plan
    region = _regions(sample)
    count = REGIONS_A_SIDE**2
    numbers = len(plan.patterns)
    matrix = np.zeros((numbers, count, CAUSES, CAUSES))
    vector = np.zeros((numbers, count, CAUSES))
    partner, by_row = partners(plan), _photos_of_codes(plan)
    scale = float(fits.white.max()) or 1.0
    for number in range(numbers):
        causes = _effects(fits, plan, number, partner.get(number), scale)
        if isinstance(pattern := plan.patterns[number], LampCode) and pattern.purpose != "check":
            causes[OF_PROJECTOR] = effects_on_code(fits, plan, pattern, by_row)
        weight = 1 / fits.variance[number]
        difference = fits.photos[number] - fits.relit[number]
        for place in range(count):
            where = region == place
            if not where.any():
                continue
            effects = causes[:, where].reshape(CAUSES, -1).astype(np.float64)
            weighted = effects * weight[where].ravel()
            matrix[number, place] = weighted @ effects.T
            vector[number, place] = weighted @ difference[where].ravel()
    return NormalEquations(matrix, vector, fits.photos[0].size)


def _effects(
    fits: Fits, plan: Plan, number: int, partner: int | None, scale: float
) -> NDArray[np.float32]:
    """Return the derivatives of a photo by the causes, (causes, rows, columns, channels)."""
    relit, pattern = fits.relit[number], plan.patterns[number]
    lit = relit - fits.black
    effects = np.zeros((CAUSES, *relit.shape), dtype=np.float32)
    effects[GAIN], effects[OFFSET] = lit, mean_white(fits)
    effects[DOWN], effects[ACROSS] = _derivatives(relit)
    effects[CAMERA_FOCUS] = _derivatives(effects[DOWN])[0] + _derivatives(effects[ACROSS])[1]
    # A bend that leaves black and half of white as they are: the gain is not of interest.
    effects[BEND] = lit**2 / scale - lit / 2
    if isinstance(pattern, Sinusoid) and pattern.frequency != DC:
        cycles = 2 * np.pi * np.array([float(part) for part in pattern.frequency])
        modulation = lit - fits.white / 2
        effects[PROJECTOR_FOCUS] = float(cycles @ cycles) * modulation
        if partner is not None:
            # The derivative of a cosine is the sine, of a sine less the cosine.
            sign = 1.0 if pattern.kind == "cosine" else -1.0
            other = sign * (fits.relit[partner] - fits.black - fits.white / 2)
            effects[PROJECTOR_DOWN], effects[PROJECTOR_ACROSS] = (
                np.float32(part) * other for part in cycles
            )
    return effects


def effects_on_code(
    fits: Fits, plan: Plan, code: LampCode, by_row: dict[int, int]
) -> NDArray[np.float32]:
    """Return the derivatives of a code's photo by the projector's causes, as in `_effects`.

    A code that is shifted by one projector pixel is the code of the next row, but for the
    projector's border.
    """

    def relit(step: int) -> Floats:
        return np.asarray(fits.relit[by_row[(code.row + step) % code.order]])

    down, across = plan.projector.width, 1
    shifts = [(relit(-step) - relit(step)) / 2 for step in (down, across)]
    steps = (down, -down, across, -across)
    focus = len(steps) * relit(0) - sum(relit(step) for step in steps)
    return np.stack([*shifts, focus]).astype(np.float32)


def _photos_of_codes(plan: Plan) -> dict[int, int]:
    """Return a photo of each row of the codes of a plan."""
    if not plan.is_by_codes:
        return {}
    return {row: number for number, row in find_codes(plan).rows.items()}


def partners(plan: Plan) -> dict[int, int]:
    """Return for each cosine a photo of its sine, and the other way round."""
    first: dict[tuple[object, str], int] = {}
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid) and not pattern.inverse and not is_reference(pattern):
            first.setdefault((pattern.frequency, pattern.kind), number)
    found = {}
    for number, pattern in enumerate(plan.patterns):
        if isinstance(pattern, Sinusoid) and not pattern.inverse and not is_reference(pattern):
            other = first.get((pattern.frequency, "sine" if pattern.kind == "cosine" else "cosine"))
            if other is not None:
                found[number] = other
    return found


def _derivatives(picture: Floats) -> tuple[Floats, Floats]:
    """Return the derivatives down and across of a sample, within its patches."""
    found = []
    for axis in (0, 1):
        length = picture.shape[axis]
        if length % PATCH or length < 2 * PATCH:
            parts = [picture]
        else:
            parts = np.split(picture, length // PATCH, axis=axis)
        found.append(
            np.concatenate(
                [
                    np.gradient(part, axis=axis) if part.shape[axis] > 1 else np.zeros_like(part)
                    for part in parts
                ],
                axis=axis,
            )
        )
    return found[0], found[1]


def mean_white(fits: Fits) -> float:
    """Return the unit of ambient light: the mean of white."""
    return max(float(fits.white.mean()), 1e-12)


def _regions(sample: CameraSample) -> Integers:
    """Return the region of each sampled camera pixel, (rows, columns)."""
    down, across = (
        lines * REGIONS_A_SIDE // max(1, side)
        for lines, side in zip((sample.rows, sample.columns), sample.camera, strict=True)
    )
    return np.add.outer(REGIONS_A_SIDE * down, across)


def serves(plan: Plan, *purposes: str) -> Booleans:
    """Return which photos of a plan serve one of some purposes, (photos,)."""
    return np.array([pattern.purpose in purposes for pattern in plan.patterns])


def inverse_photos(plan: Plan) -> list[tuple[int, int]]:
    """Return every photo of a plan with each photo of the inverse of its pattern, both ways."""
    numbers: dict[Pattern, list[int]] = {}
    for number, pattern in enumerate(plan.patterns):
        numbers.setdefault(pattern, []).append(number)
    found = []
    for pattern, mine in numbers.items():
        if isinstance(pattern, Sinusoid | HalfScreen | Picture):
            inverse = pattern.model_copy(update={"inverse": not pattern.inverse})
            found += [(one, other) for one in mine for other in numbers.get(inverse, [])]
    return found


def is_white_or_black(plan: Plan) -> Booleans:
    """Return which photos of a plan are of white or black, (photos,)."""
    return np.array([is_reference(pattern) for pattern in plan.patterns])
