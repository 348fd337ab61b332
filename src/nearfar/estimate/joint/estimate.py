"""The joint estimate: direct, near and far in one model, each camera pixel with a prior of its own.

The first sweep chooses a prior component and scale for every camera pixel by its own photos, and
returns the posterior mean. Later sweeps start from the expectation from its neighbours and
estimate the difference. What the residuals of neighbours have in common after the last one is
added.
"""

from collections.abc import Callable
from itertools import zip_longest

import numpy as np

from nearfar.arrays import Floats, Integers, Size, beside, fetch, namespace
from nearfar.devices import Device
from nearfar.errors import InputError
from nearfar.estimate.joint.assemble import assemble
from nearfar.estimate.joint.batch import AllPixels
from nearfar.estimate.joint.chessboard import Part, every_choice, part_of_sweep
from nearfar.estimate.joint.footprint import VOTING_ROWS, footprint_boxes
from nearfar.estimate.joint.foretold import ErrorsOfForetold, summed_up
from nearfar.estimate.joint.half_sweep import sweep_half
from nearfar.estimate.joint.own_footprint import own_footprints
from nearfar.estimate.joint.problem import Choices, ComponentChoice, EstimatedRows, Problem, lay_out
from nearfar.estimate.joint.quantisation import subtract_quantisation
from nearfar.estimate.joint.remainder import REMAINDER_ROWS, with_remainder
from nearfar.estimate.joint.second_places import (
    SecondPlaces,
    find_second_places,
    without_second_places,
)
from nearfar.estimate.joint.shifts import moved_q, with_unshifted_light
from nearfar.estimate.joint.sweep import squares_of_foretold, sweep_once
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.near_basis import NearBasis
from nearfar.photometry.measurements import Measurements
from nearfar.priors.fitted import LIT_COMPONENTS
from nearfar.transport import near
from nearfar.transport.model import Transport
from nearfar.transport.seen import box_centres, seen_of_projector

NO_CHOICES = Choices()
# Sweeps: one by each camera pixel's own photos alone, the rest with its neighbours.
SWEEPS = 3
# At a pitch over 1 each sweep but the last is two, of half of the camera pixels each.
HALF_SWEEPS = 2 * SWEEPS - 1
# Camera rows on either side of a row that its estimate depends on at a pitch over 1: neighbours in
# sweeps and after them, and those that vote for footprints before the first sweep and after the
# second.
ROWS_BESIDE = HALF_SWEEPS - 2 + 2 * VOTING_ROWS + REMAINDER_ROWS


def estimate_jointly(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    far: Size,
    *,
    pitch: int,
    rows: slice | None = None,
    chosen: Choices = NO_CHOICES,
    device: Device = "cpu",
    progress: Callable[[float], None] | None = None,
) -> Transport:
    """Estimate D, N and F together.

    Parameters
    ----------
    measurements : Measurements
        With white, and at least one other frequency.
    correspondence : ndarray, shape (Cy, Cx, 2)
        q as (y, x), NaN where there is no direct light. In the transport it is rounded where it is
        nearly whole, and elsewhere shifted a little to fit the photos; it is NaN also where the
        photos are more probable without direct light.
    window : int
        W, an upper bound of how far near-range light reaches, in functions.
    far : Size
        Far band: f is kept at its measured frequencies, and at other measured ones that are whole
        numbers of cycles per pattern grid.
    pitch : int
        Projector pixels between the window's functions, as the plan has it.
    rows : slice, optional
        Camera rows of the transport, by default all that were measured. The others lie beside them,
        and are estimated only as far as these depend on them.
    chosen : Choices
        Prior components and scales that `choose_components` chose by some of the photos.
    device : {"cpu", "cuda", "torch"}
        Device of the estimate: NumPy, PyTorch on an accelerator, or PyTorch on the processor.
    progress : callable, optional
        Called with the share done.

    Returns
    -------
    Transport

    Raises
    ------
    InputError
        If white or everything but white was not measured, or the device is not there, or is not
        "cpu" at a pitch over 1.
    """
    report = progress or (lambda _share: None)
    problem = _laid_out(measurements, correspondence, NearBasis(window, pitch), device)
    rows = rows or slice(0, measurements.camera.height)
    problem, swept, second, held = _sweep(problem, rows, SWEEPS, chosen, report)
    swept, unexplained = with_remainder(problem, swept)
    wanted = slice(rows.start - held.start, rows.stop - held.start)
    unexplained = unexplained[_pixels(problem, wanted)]
    problem, found = _of_rows(problem, swept, held, rows)
    assert found is not None
    second = second and second.within(_pixels(problem, rows))
    return assemble(problem, found, far, unexplained, second)


def estimate_by_sweeps(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    far: Size,
    *,
    pitch: int,
    sweeps: int = SWEEPS,
) -> Transport:
    """Estimate D, N and F together, without what neighbours' residuals have in common.

    What is wrong with a photo at all camera pixels is a part of that, and would fit such photos.

    Parameters
    ----------
    measurements, correspondence, window, far, pitch
        As `estimate_jointly` takes them.
    sweeps : int
        Number of sweeps: the first by each camera pixel's own photos, the others with neighbours.
        At a pitch over 1 each but the last is two sweeps, of half of the camera pixels each.

    Returns
    -------
    Transport

    Raises
    ------
    InputError
        As `estimate_jointly`.
    """
    problem = _laid_out(measurements, correspondence, NearBasis(window, pitch), "cpu")
    every = slice(0, measurements.camera.height)
    problem, found, second, _ = _sweep(problem, every, sweeps, NO_CHOICES, lambda _share: None)
    return assemble(problem, found, far, np.ones_like(problem.pixels.white), second)


def errors_of_foretold(
    measurements: Measurements, correspondence: Floats, window: int
) -> dict[Frequency, ErrorsOfForetold]:
    """Return for each measured frequency how far off its responses are from what others foretell.

    Functions are of single projector pixels. A photo that is the only one of its pattern always
    fits the transport that is estimated from it; this tells whether it fits the other photos.

    Parameters
    ----------
    measurements, correspondence, window
        As `estimate_jointly` takes them.

    Returns
    -------
    dict of ErrorsOfForetold
        Of cosine and sine, the larger one.
    """
    problem = _laid_out(measurements, correspondence, NearBasis(window, 1), "cpu")
    squares, basis = squares_of_foretold(problem), problem.model.centred.basis
    errors = summed_up(squares, np.asarray(basis.index), measurements.camera)
    return dict(zip(basis.frequencies, errors, strict=True))


def choose_components(
    measurements: Measurements,
    correspondence: Floats,
    window: int,
    *,
    pitch: int,
    device: Device = "cpu",
    progress: Callable[[float], None] | None = None,
) -> Choices:
    """Choose each camera pixel's prior components from the first photos of a capture.

    Parameters and errors are those of `estimate_jointly`.

    Returns
    -------
    Choices
        Of each sweep, and of the error bars.
    """
    report = progress or (lambda _share: None)
    problem = _laid_out(measurements, correspondence, NearBasis(window, pitch), device)
    every = slice(0, measurements.camera.height)
    _, found, _, _ = _sweep(problem, every, SWEEPS, NO_CHOICES, report)
    return found.choices


def _laid_out(
    measurements: Measurements, correspondence: Floats, near_basis: NearBasis, device: Device
) -> Problem:
    """Lay out a problem, with the footprints that q and the highest frequencies show."""
    if near_basis.pitch > 1 and device != "cpu":
        raise InputError(
            f"a plan for every projector pixel, at a pitch of {near_basis.pitch}, is estimated on "
            f"the processor alone: leave out `device`."
        )
    if near_basis.pitch == 1:
        return lay_out(measurements, correspondence, near_basis, device, None)
    seen = seen_of_projector(correspondence)
    middles = box_centres(correspondence, seen)
    voted = footprint_boxes(measurements, middles, seen, near_basis)
    middles, boxes = own_footprints(measurements, middles, voted, near_basis)
    return lay_out(measurements, middles, near_basis, device, boxes)


def _sweep(
    problem: Problem,
    wanted: slice,
    sweeps: int,
    chosen: Choices,
    progress: Callable[[float], None],
) -> tuple[Problem, EstimatedRows, SecondPlaces | None, slice]:
    """Make the sweeps over the camera rows that the wanted ones depend on; shift q after each.

    Returns the problem and the rows of those camera rows that are held in the end, second places,
    and which camera rows these are: the wanted ones, and some on either side.
    """
    found, held = None, slice(0, problem.measurements.camera.height)
    second: SecondPlaces | None = None
    halves = problem.near_basis.pitch > 1
    # Where each is of half of the camera pixels, one alone would leave out the others.
    sweeps = max(2, 2 * sweeps - 1) if halves else sweeps
    for number, choice in zip_longest(range(sweeps), chosen.sweeps[:sweeps]):
        around = _rows_around(problem, held, wanted, number, sweeps)
        problem, found = _of_rows(problem, found, held, around)
        held = around

        def report(share: float, number: int = number) -> None:
            progress((number + share) / sweeps)

        mine = choice and choice.of(_pixels(problem, held))
        part = part_of_sweep(problem, number) if halves else None
        if part is None:
            found = sweep_once(problem, found, report, mine)
        else:
            found = sweep_half(problem, found, report, mine, part)
        # They are read off neighbours, which the first sweep alone leaves out.
        if number == 0 and not halves and sweeps > 1:
            problem, found, second = _with_second_places(problem, found, mine)
        if number == 0 and chosen.of_error_bars is not None:
            found = _with_bars_of(found, chosen.of_error_bars.of(_pixels(problem, held)))
        is_last = number >= sweeps - (2 if halves else 1)
        before = problem
        problem = _with_new_q(problem, found, part, is_last=is_last)
        if is_last and not halves:
            found = with_unshifted_light(before, problem.pixels.correspondence, found)
        if halves and number < sweeps - 1:
            # Later sweeps hardly move q: new footprints after each of them change no light's SNR
            # by more than 0.01 dB.
            if number == 1:
                problem = _with_new_footprints(problem)
                subtract_quantisation(problem, found)
            problem = _about_new_q(problem)
    assert found is not None
    if halves:
        # Of the rows beside the wanted ones as well, which some take their choice from.
        pixels, camera = problem.pixels, problem.measurements.camera
        first = found.choices.sweeps[0]
        bars = every_choice(first, pixels.is_even, pixels.lit, camera)
        found = found._replace(choices=found.choices._replace(of_error_bars=bars))
    return problem, found, second, held


def _with_second_places(
    problem: Problem, found: EstimatedRows, chosen: ComponentChoice | None
) -> tuple[Problem, EstimatedRows, SecondPlaces]:
    """Return a problem without light from second places, first rows of it, and that light.

    Camera pixels that have some are estimated anew. Where the photos then show no direct light at
    q, there is but one place, and all stays as it was.
    """
    second = find_second_places(problem, found)
    if not len(second.pixels):
        return problem, found, second
    here, row = beside(second.pixels, problem.pixels.responses), Size(1, len(second.pixels))
    some = _of_pixels(without_second_places(problem, second), row, here)
    anew = sweep_once(some, None, lambda _share: None, chosen and chosen.of(here))
    is_lit = fetch(anew.choices.sweeps[-1].prior_component) < len(LIT_COMPONENTS)
    (kept,) = np.nonzero(is_lit)
    second = second.of(kept)
    here, kept = beside(second.pixels, here), beside(kept, here)
    for values, own in zip(found[:-1], anew[:-1], strict=True):
        values[here] = own[kept]
    own_choice = anew.choices.sweeps[-1].of(kept)
    for choice in (found.choices.sweeps[-1], found.choices.of_error_bars):
        if choice is not None:
            choice.prior_component[here] = own_choice.prior_component
            choice.prior_scale[here] = own_choice.prior_scale
    return without_second_places(problem, second), found, second


def _of_pixels(problem: Problem, camera: Size, pixels: slice | Integers) -> Problem:
    """Return the problem of some camera pixels, as a camera of size `camera`."""
    measured = pixels if isinstance(pixels, slice) else fetch(pixels)
    return problem._replace(
        measurements=problem.measurements.of_pixels(camera, measured),
        pixels=AllPixels._make(values[pixels] for values in problem.pixels),
    )


def _with_bars_of(found: EstimatedRows, given: ComponentChoice) -> EstimatedRows:
    """Return rows with given components of the error bars, where they are lit as estimated."""
    own = found.choices.sweeps[0]
    xp, first_unlit = namespace(own.prior_scale), len(LIT_COMPONENTS)
    is_same = (own.prior_component < first_unlit) == (given.prior_component < first_unlit)
    bars = ComponentChoice._make(
        xp.where(is_same, theirs, its) for theirs, its in zip(given, own, strict=True)
    )
    return found._replace(choices=found.choices._replace(of_error_bars=bars))


def _rows_around(problem: Problem, held: slice, wanted: slice, number: int, sweeps: int) -> slice:
    """Return the camera rows, of those held, that a sweep estimates for the sake of wanted rows.

    It and those after it read the rows of neighbours, and footprints are voted for with the q that
    the first two find. Where functions are of single pixels there are few of them, and all are
    estimated.
    """
    if problem.near_basis.pitch == 1 or held == wanted:
        return held
    beside = sweeps - 2 + VOTING_ROWS if number < 2 else sweeps - number
    beside += REMAINDER_ROWS
    return slice(max(held.start, wanted.start - beside), min(held.stop, wanted.stop + beside))


def _of_rows(
    problem: Problem, found: EstimatedRows | None, held: slice, rows: slice
) -> tuple[Problem, EstimatedRows | None]:
    """Return some camera rows of a problem that holds more, and of what was found."""
    if rows == held:
        return problem, found
    camera = Size(rows.stop - rows.start, problem.measurements.camera.width)
    some = _pixels(problem, slice(rows.start - held.start, rows.stop - held.start))
    problem = _of_pixels(problem, camera, some)
    if found is not None:
        found = EstimatedRows(
            amplitudes=found.amplitudes[some],
            near=found.near[some],
            far=found.far[some],
            near_noise=found.near_noise[some],
            noise_left=found.noise_left[some],
            choices=found.choices.of(some),
        )
    return problem, found


def _pixels(problem: Problem, rows: slice) -> slice:
    width = problem.measurements.camera.width
    return slice(rows.start * width, rows.stop * width)


def _with_new_footprints(problem: Problem) -> Problem:
    """Return the problem with the footprints of the q that its last sweep found."""
    pixels, measurements = problem.pixels, problem.measurements
    q = fetch(pixels.correspondence).reshape(*measurements.camera, 2)
    voted = footprint_boxes(measurements, q, seen_of_projector(q), problem.near_basis)
    q, footprints = own_footprints(measurements, q, voted, problem.near_basis)
    changes = (q.reshape(-1, 2), footprints)
    moved, boxes = (beside(values, pixels.white) for values in changes)
    return problem._replace(pixels=pixels._replace(correspondence=moved, footprint=boxes))


def _about_new_q(problem: Problem) -> Problem:
    """Return the problem with windows about the q that its last sweep found."""
    pixels, measurements = problem.pixels, problem.measurements
    q = fetch(pixels.correspondence).reshape(*measurements.camera, 2)
    centres = beside(near.centre(q, measurements.projector), pixels.white)
    return problem._replace(pixels=pixels._replace(centres=centres))


def _with_new_q(
    problem: Problem, found: EstimatedRows, part: Part | None, *, is_last: bool
) -> Problem:
    """Return the problem with the q, and the direct light, that a sweep found."""
    pixels = problem.pixels
    lit = found.choices.sweeps[-1].prior_component < len(LIT_COMPONENTS)
    moved = moved_q(problem, found, lit, is_last=is_last)
    if part is not None:
        kept = np.ones(len(lit), dtype=bool)
        kept[part.selected] = False
        lit[kept], moved[kept] = pixels.lit[kept], pixels.correspondence[kept]
    return problem._replace(pixels=pixels._replace(lit=lit, correspondence=moved))
