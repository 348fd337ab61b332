"""Light that changed at once: photos about it look like others than they are.

The drift between two photos of white, or of black, is taken to be steady. Where light changed at
once, the photos between them are off on both sides of the change, most of all those next to it.
"""

from collections.abc import Sequence

import numpy as np

from nearfar.arrays import Floats, Integers
from nearfar.faults.of_light import AmbientJumped, ColoursJumped, ExposureChanged, LampJumped
from nearfar.faults.of_photos import Spoilt
from nearfar.faults.of_single_photos import PhotosMisfit
from nearfar.photometry.drift import References

# Change between two photos of one pattern, over the largest that is seen in a photo between them;
# and over the change between any other two.
LEAST_OVER_SEEN, LEAST_OVER_OTHERS = 0.8, 4.0
# Change of a colour, over the mean of all, that is told where no photo between two of white does.
LEAST_OF_COLOUR = 0.015
# Fewer photos of white do not tell a jump from drift.
FEWEST_WHITES = 4


def name_jumps(found: Sequence[Spoilt], photos: Floats, references: References) -> list[Spoilt]:
    """Replace photos under another exposure by the jump of light that explains them.

    Photos that do not fit, and lie where the light jumped, are left out.

    Parameters
    ----------
    found : sequence of Spoilt
        Only those that are `ExposureChanged` are looked at.
    photos : ndarray, shape (photos, rows, columns, channels)
        All photos of a sample as they were taken, in photo units.
    references : References
    """
    named = [
        _jump_of(each, photos, references) if isinstance(each, ExposureChanged) else each
        for each in found
    ]
    jumps = [each for each in named if isinstance(each, LampJumped | AmbientJumped)]
    return [
        each
        for each in named
        if not isinstance(each, PhotosMisfit)
        or not any(_are_between(each.photos, jump) for jump in jumps)
    ]


def find_jump_of_colours(lamp: Floats, whites: Integers) -> list[ColoursJumped]:
    """Find whether colours changed at once between two photos of white, and not at other times.

    Parameters
    ----------
    lamp : ndarray, shape (whites, channels)
        Gain of the lamp at each photo of white.
    whites : ndarray of int
        Their numbers.
    """
    if len(whites) < FEWEST_WHITES:
        return []
    colours = lamp / lamp.mean(axis=1, keepdims=True)
    steps = np.abs(np.diff(colours, axis=0)).max(axis=1)
    place = int(np.argmax(steps))
    others = float(np.max(np.delete(steps, place)))
    if steps[place] < max(LEAST_OF_COLOUR, LEAST_OVER_OTHERS * others):
        return []
    gains = lamp[place + 1] / lamp[place] - 1
    after, before = whites[place : place + 2].tolist()
    return [ColoursJumped(after, before, tuple(gains.tolist()))]


def mean_light(photos: Floats, references: References) -> float:
    """Return the mean of white less black, in photo units; above 0.

    Parameters
    ----------
    photos, references
        As `name_jumps` takes them.
    """
    white, black = (float(photos[numbers].mean()) for numbers in references)
    return max(white - black, float(np.finfo(np.float32).tiny))


def _are_between(photos: Sequence[int], jump: LampJumped | AmbientJumped) -> bool:
    """Return whether photos lie between the two that tell of a jump."""
    return all(jump.after <= number <= jump.before for number in photos)


def _jump_of(
    found: ExposureChanged, photos: Floats, references: References
) -> ExposureChanged | LampJumped | AmbientJumped:
    """Return the jump of light that explains photos under another exposure; else these photos."""
    white, black = (photos[numbers].mean(axis=(1, 2, 3)) for numbers in references)
    light = mean_light(photos, references)
    is_ambient = abs(found.offset) > abs(found.gain)
    numbers, levels = (references.blacks, black) if is_ambient else (references.whites, white)
    steps = np.diff(levels) / light
    place = int(np.argmax(np.abs(steps)))
    after, before = int(numbers[place]), int(numbers[place + 1])
    step, others = float(steps[place]), np.delete(np.abs(steps), place)
    if (
        abs(step) < LEAST_OVER_SEEN * max(abs(found.gain), abs(found.offset))
        or abs(step) < LEAST_OVER_OTHERS * np.max(others, initial=0.0)
        or not all(after <= number <= before for number in found.photos)
    ):
        return found
    return (AmbientJumped if is_ambient else LampJumped)(after, before, step)
