"""Faults of a capture as a whole: motion, focus, flicker, a response that is not linear.

How much of the photos' misfits each of them explains is read off the normal equations of
`nearfar.workflow.diagnosis.misfit`, in misfits summed over photos: 1 is a photo's noise.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Integers
from nearfar.faults.of_light import AmbientFlickers, ExposureChanged, LampFlickers
from nearfar.faults.of_photos import Moved, NotLinear, Spoilt
from nearfar.files import from_srgb
from nearfar.photometry.drift import find_references
from nearfar.plan.checks import check_lights
from nearfar.workflow.diagnosis.bend_of_pairs import Bend
from nearfar.workflow.diagnosis.changes import (
    Stay,
    Step,
    best_stay,
    best_step,
    explained_by,
    solved,
)
from nearfar.workflow.diagnosis.misfit import (
    ACROSS,
    BEND,
    CAMERA_FOCUS,
    DOWN,
    GAIN,
    LEAST_IN_SUM,
    OFFSET,
    PROJECTOR_ACROSS,
    PROJECTOR_DOWN,
    PROJECTOR_FOCUS,
    SMALLEST_CHANGE,
    NormalEquations,
)
from nearfar.workflow.diagnosis.sample import CameraSample

# Misfit that a cause has to explain at least.
LEAST_EXPLAINED = 1.0
# Share of the photos' misfits beyond 1, summed, that a change at one moment has to explain.
LEAST_SHARE = 0.05
# A change at one moment lies at least so many photos from both ends.
FROM_THE_ENDS = 4
# One change has to explain this share of what effects of a size of their own in each photo do.
LEAST_OF_EACH = 0.3
# A motion there and back has to explain so many times what one change does.
STAY_OVER_CHANGE = 2.0
# Misfit of the photos of white that has to be explained where camera or scene moved.
LEAST_OF_WHITE = 0.3
# A bend of the response has to explain at least this, and this share of the misfits beyond 1.
LEAST_BEND = 0.5
LEAST_SHARE_OF_BEND = 0.02
# It explains no more than all of them: with much noise estimates are shrunk, and what is left is in
# proportion to the light.
LARGEST_SHARE_OF_BEND = 1.01
# Photos of inverse patterns contradict a bend if theirs is less than this share of it, by so many
# standard deviations.
LEAST_SHARE_IN_PAIRS, SURE_DEVIATIONS = 0.5, 2.0
# Exposure explains this many times what a bend does where it changes from photo to photo.
EXPOSURE_OVER_BEND = 7.0
# Above this, light changes from photo to photo, not in a few.
FLICKER = 8.0
# Of the photos, the share in which it does.
FLICKER_SHARE = 0.2
# It is ambient light that changes if that alone explains this many times what exposure alone does.
AMBIENT_OVER_EXPOSURE = 2.0
# Decoders of light by the name of the encoding; if it is the photos', at most this share of the
# excess of their sums is left.
DECODINGS: Mapping[str, Callable[[Floats], Floats]] = {
    "sRGB": lambda values: from_srgb(np.clip(values, 0.0, 1.0)),
    "a gamma of 2.2 (values are light to the power 1/2.2 = 0.45)": lambda values: (
        np.maximum(values, 0.0) ** 2.2
    ),
}
NAMED_SHARE = 0.2


def find_changes(
    equations: NormalEquations,
    misfit: Floats,
    whites: Integers,
    inverses: Sequence[tuple[int, int]] = (),
    of_pairs: Bend | None = None,
) -> list[Spoilt]:
    """Find the changes of rig and scene while photos were taken, at one moment or all the time.

    Parameters
    ----------
    equations : NormalEquations
    misfit : ndarray, shape (photos,)
    whites : ndarray of int
        Numbers of the photos of white.
    inverses : sequence of tuple of int
        Photos, and those of the inverses of their patterns.
    of_pairs : Bend, optional
        The bend of the response by photos of inverse patterns.

    Returns
    -------
    list of Spoilt
        The one that explains most first, but motion before all else where photos of white show it;
        empty if there are too few photos to tell.
    """
    if len(misfit) <= 2 * FROM_THE_ENDS:
        return []
    beyond_noise = float(np.maximum(misfit - 1, 0).sum())
    least = max(LEAST_EXPLAINED, LEAST_SHARE * beyond_noise)
    whole = equations.whole
    found: list[tuple[float, Spoilt]] = []
    camera = _step(whole, [DOWN, ACROSS], whites=whites)
    regions = [
        _step(equations, [DOWN, ACROSS], i, whites) for i in range(equations.matrix.shape[1])
    ]
    in_regions = sum(step.explained for step in regions)
    projector = max(
        (
            _step(whole, causes)
            for causes in ([PROJECTOR_DOWN, PROJECTOR_ACROSS], [PROJECTOR_FOCUS])
        ),
        key=lambda step: step.explained,
    )
    focus = _step(whole, [CAMERA_FOCUS])
    # What explains more than photos differ by beyond noise explains noise.
    projector, focus = (
        step if step.explained < beyond_noise else step._replace(explained=0.0)
        for step in (projector, focus)
    )
    # White looks the same wherever the projector is, and under any lamp but for its brightness. The
    # transport does not bend to it, so that it tells a motion from another focus.
    shift_of_white = _explained_of_white(equations, whites, [DOWN, ACROSS])
    of_white = shift_of_white > LEAST_OF_WHITE
    if of_white:
        projector = projector._replace(explained=0.0)
        if _explained_of_white(equations, whites, [CAMERA_FOCUS]) < shift_of_white:
            focus = focus._replace(explained=0.0)
    stay = _stay(whole, whites)
    # Whites that show a motion show this one, too.
    shown = not of_white or bool(np.any((whites >= stay.photo) & (whites < stay.until)))
    of_one_change = max(projector.explained, focus.explained, camera.explained, in_regions)
    if shown and stay.explained > max(least, STAY_OVER_CHANGE * of_one_change):
        found.append((stay.explained, Moved("camera", stay.photo, None, stay.until)))
    elif projector.explained > max(least, in_regions, focus.explained):
        found.append((projector.explained, Moved("projector", projector.photo, None)))
    elif focus.explained > max(least, in_regions):
        found.append((focus.explained, Moved("camera's focus", focus.photo, None)))
    elif camera.explained > max(least, in_regions / 2):
        # A camera that moves does so everywhere.
        pixels = _shift(whole, camera.photo, whites)
        found.append((camera.explained, Moved("camera", camera.photo, pixels)))
    elif in_regions > least:
        region = max(range(len(regions)), key=lambda i: regions[i].explained)
        photo = regions[region].photo
        pixels = _shift(equations, photo, whites, region)
        found.append((in_regions, Moved("scene", photo, pixels)))
    light = find_changes_of_light(whole, inverses)
    bend = _explained_by_bend(whole, of_pairs)
    least_bend = max(LEAST_BEND, LEAST_SHARE_OF_BEND * beyond_noise)
    is_bent = least_bend < bend < LARGEST_SHARE_OF_BEND * beyond_noise
    if is_bent and (light is None or light[0] < EXPOSURE_OVER_BEND * bend):
        found.append((light[0] if light else bend, NotLinear("")))
    elif light is not None and light[0] > least:
        found.append(light)
    if not of_white:
        found.sort(key=lambda each: -each[0])
    return [each for explained, each in found if explained > found[0][0] / 4]


def _explained_by_bend(whole: NormalEquations, of_pairs: Bend | None) -> float:
    """Return the misfit that a bend of the response explains; 0 if inverse photos contradict it.

    What an estimate is off by is often in proportion to the light, as a bend is, but cancels in the
    sum of a pattern's photo and its inverse's.
    """
    matrix, vector = (part.sum(axis=(0, 1)) for part in (whole.matrix, whole.vector))
    size = vector[BEND] / max(matrix[BEND, BEND], 1e-300)
    if of_pairs is not None:
        same = of_pairs.size * np.sign(size)
        missing = abs(size) - same
        if (
            same < LEAST_SHARE_IN_PAIRS * abs(size)
            and missing > SURE_DEVIATIONS * of_pairs.deviation
        ):
            return 0.0
    return explained_by(matrix, vector, [BEND]) / whole.values


def _explained_of_white(equations: NormalEquations, whites: Integers, causes: list[int]) -> float:
    """Return the misfit of the photos of white that one change of some causes explains."""
    steps = [
        best_step(
            equations.matrix[whites, region][:, causes][:, :, causes],
            equations.vector[whites, region][:, causes],
            np.arange(1, len(whites)),
        )
        for region in range(equations.matrix.shape[1])
    ]
    return sum(step.explained for step in steps) / equations.values


def _shift(equations: NormalEquations, photo: int, whites: Integers, region: int = 0) -> float:
    """Return by how many pixels pictures of white after a photo are shifted from those before.

    These are all of one pattern, so that the transport takes the mean of their places. Other photos
    are nearly alone with their pattern, and the transport goes with them.
    """
    causes = [DOWN, ACROSS]
    sizes = []
    for chosen in (whites[whites < photo], whites[whites >= photo]):
        matrix = equations.matrix[chosen, region].sum(axis=0)[np.ix_(causes, causes)]
        sizes.append(solved(matrix, equations.vector[chosen, region].sum(axis=0)[causes]))
    return float(np.hypot(*(sizes[1] - sizes[0])))


def find_changes_of_light(
    equations: NormalEquations, inverses: Sequence[tuple[int, int]] = ()
) -> tuple[float, Spoilt] | None:
    """Find photos under other light than the transport's, or light that changes all the time.

    Parameters
    ----------
    equations : NormalEquations
    inverses : sequence of tuple of int
        Photos, and those of the inverses of their patterns. Where both together are white without
        any change, the transport is wrong, and the light was not.
    """
    causes = [GAIN, OFFSET]
    matrix = equations.matrix[:, 0][:, causes][:, :, causes]
    vector = equations.vector[:, 0][:, causes]
    effects = solved(matrix, vector)
    explained = np.einsum("np,np->n", vector, effects) / equations.values
    total = float(explained.sum())
    largest = np.abs(effects).max(axis=1)
    # No exposure takes away more than all light.
    is_change = (largest > SMALLEST_CHANGE) & (effects[:, 0] > -1)
    for one, other in inverses:
        # A gain g of both and offsets that sum to -g cancel: lit by a pattern and its inverse, a
        # camera pixel is lit by white.
        (gain, offset), (its_gain, its_offset) = effects[one], effects[other]
        left = max(abs(gain - its_gain), abs((gain + its_gain) / 2 + offset + its_offset))
        is_change[one] &= left >= LEAST_IN_SUM * largest[one]
    changed = np.flatnonzero((explained > LEAST_EXPLAINED) & is_change)
    if total > FLICKER and np.mean(explained > FLICKER / 40) > FLICKER_SHARE:
        gain, offset = (_explained_by_one(matrix, vector, cause) for cause in (0, 1))
        if offset > AMBIENT_OVER_EXPOSURE * gain:
            return total, AmbientFlickers(float(effects[:, 1].std()))
        return total, LampFlickers(float(effects[:, 0].std()))
    if not len(changed):
        return None
    gains, offsets = effects[changed].T
    return total, ExposureChanged(
        tuple(changed.tolist()),
        float(max(gains, key=abs)),
        float(max(offsets, key=abs)),
    )


def _explained_by_one(
    matrix: NDArray[np.float64], vector: NDArray[np.float64], cause: int
) -> float:
    """Return the squares that one cause alone explains, of a size of its own in each photo."""
    sizes = solved(matrix[:, [cause]][:, :, [cause]], vector[:, [cause]])
    return float(np.sum(sizes * vector[:, [cause]]))


def _step(
    equations: NormalEquations,
    causes: list[int],
    region: int = 0,
    whites: Integers | None = None,
) -> Step:
    """Return the best change of some causes between two photos.

    The photos of white, where they tell of the causes, tell best between which two of them it was:
    the transport does not bend to them. Where they do not tell, there is no such change if effects
    of a size of its own in each photo explain far more.
    """
    matrix = equations.matrix[:, region][:, causes][:, :, causes]
    vector = equations.vector[:, region][:, causes]
    last = len(matrix)
    candidates = np.arange(FROM_THE_ENDS, last - FROM_THE_ENDS)
    if whites is not None and len(whites) > 2:
        place = best_step(matrix[whites], vector[whites], np.arange(1, len(whites))).photo
        candidates = np.arange(whites[place - 1] + 1, whites[place] + 1)
    best = best_step(matrix, vector, candidates)
    in_each = float(np.sum(solved(matrix, vector) * vector))
    if whites is None and best.explained < LEAST_OF_EACH * in_each:
        return best._replace(explained=0.0)
    return best._replace(explained=best.explained / equations.values)


def _stay(equations: NormalEquations, whites: Integers) -> Stay:
    """Return the best motion of the camera there and back.

    The transport does not bend to whites, which show a motion in full where other photos show some
    of it: they are left out.
    """
    causes = [DOWN, ACROSS]
    matrix = equations.matrix[:, 0][:, causes][:, :, causes].copy()
    vector = equations.vector[:, 0][:, causes].copy()
    matrix[whites] = vector[whites] = 0.0
    best = best_stay(matrix, vector)
    in_each = float(np.sum(solved(matrix, vector) * vector))
    share = best.explained / equations.values if best.explained > LEAST_OF_EACH * in_each else 0.0
    return best._replace(explained=share)


def name_encoding(sample: CameraSample) -> str:
    """Name the encoding by which photos do not add; empty if none does.

    Once it is undone, the photos of a pattern and of its inverse sum to those of white and black.
    """
    plan = sample.plan
    whites, blacks = find_references(plan)
    white, black = (sample.photos[numbers].mean(axis=0) for numbers in (whites, blacks))
    usable = (sample.photos[whites] < 1.0).all(axis=0)
    pairs = [
        (sample.photos[list(light.photos)], sample.photos[list(light.inverses)])
        for light in check_lights(plan)
        if light.photos and light.inverses
    ]
    if not pairs:
        return ""

    def excess(decode: Callable[[Floats], Floats]) -> float:
        light = decode(white) - decode(black)
        both = sum(
            decode(one).mean(axis=0) + decode(other).mean(axis=0) - 2 * decode(black) - light
            for one, other in pairs
        )
        return abs(float(np.sum(both * usable))) / max(float(np.sum(light * usable)), 1e-300)

    as_they_are = excess(lambda values: values)
    decoded = {name: excess(decode) for name, decode in DECODINGS.items()}
    best = min(decoded, key=lambda name: decoded[name])
    return best if decoded[best] < NAMED_SHARE * as_they_are else ""
