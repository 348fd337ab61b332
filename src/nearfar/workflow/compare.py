"""Methods side by side: at equal numbers of photos, and at equal total exposure.

Every method sees the same scene, camera and noise. All photos count: stripes, inverses, references
and black too. One unit of exposure is a photo in which the brightest camera pixel comes to the full
well under white. At equal total exposure a method with fewer photos exposes each for longer, with a
full well deeper in proportion, and a method with many for less.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.callbacks import Report
from nearfar.errors import InputError, NearfarError, PlanError
from nearfar.illumination.pictures import standard_lights
from nearfar.plan.choose import FEWEST_PHOTOS
from nearfar.plan.window import default_window, pitch_of
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.opening import choose_exposure
from nearfar.transport.known import KnownTransport
from nearfar.workflow.comparison import Comparison, Failure, LeftOut, Trial
from nearfar.workflow.evaluate import snr
from nearfar.workflow.rivals import RIVALS
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.paper import default_photos
from nearfar.workflow.rivals.rival import Attempt, Budget

# A default budget is the paper's photos divided by one of these.
BUDGET_DIVISORS = (16, 8, 4, 2, 1)


def default_budgets(projector: Size) -> tuple[int, ...]:
    """Return shares of the photos of the paper's plan with a default window, the largest last.

    Where the projector is too small for one, as with a single row, shares of all its pixels.
    """
    try:
        total = default_photos(projector)
    except PlanError:
        total = max(projector.pixels, FEWEST_PHOTOS)
    return tuple(total // part for part in BUDGET_DIVISORS if total // part >= FEWEST_PHOTOS)


def compare(
    scene: KnownTransport,
    budgets: Sequence[int] | None = None,
    *,
    methods: Sequence[str] | None = None,
    window: int | None = None,
    camera: SimulatedCamera | None = None,
    progress: Report | None = None,
    on_trial: Callable[[Comparison], None] | None = None,
    note: Callable[[str], None] | None = None,
) -> Comparison:
    """Run methods on a scene at several budgets of photos, and of total exposure.

    The rivals are given their best: at each budget, the paper's method has the best of several far
    bands, and compressive light transport the regularisation that fits the truth best.
    Correspondence is found by each method itself. A method that fails, such as one whose plans do
    not fit the projector, or one that holds each entry of T of a scene that is too large for it, is
    listed with its reason, and the others go on; so is one that assumes what the scene is not, such
    as a coaxial camera.

    Parameters
    ----------
    scene : ExactTransport or ExactOperator
    budgets : sequence of int, optional
        Numbers of photos; `default_budgets` if left out.
    methods : sequence of str, optional
        Names of `nearfar.workflow.rivals.RIVALS`; all if left out.
    window : int, optional
        W of the joint estimate's plans; `default_window` if left out.
    camera : SimulatedCamera, optional
    progress : callable, optional
        Called with the title of a method and the share of its work that is done, 0 to 1.
    on_trial : callable, optional
        Called after each trial with the comparison so far, for whoever wants to keep it should the
        rest be stopped.
    note : callable, optional
        Called with a sentence before work that takes long.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        If there is no such method, none that suits the scene, or no budget that is enough for any.
    """
    methods, left_out = suited(scene, known_methods(methods))
    budgets = known_budgets(scene.projector, budgets)
    lights = standard_lights(scene.projector)
    gain = choose_exposure(None, scene, scene.name)
    truth = {name: np.float32(gain) * (scene @ light) for name, light in lights.items()}
    pitch = pitch_of(scene.projector)
    bench = Bench(
        scene,
        camera or SimulatedCamera(),
        default_window(scene.projector, pitch) if window is None else window,
        gain,
        note=note or (lambda _sentence: None),
    )
    report = progress or (lambda _what, _share: None)
    jobs = _jobs(scene.projector, methods, budgets)
    found = _Found(scene, left_out)
    for number, (method, budget) in enumerate(jobs):
        told = _of_method(report, jobs, number)
        told(0.0)
        try:
            if RIVALS[method].is_dense:
                _ = bench.matrices
            found.add(method, budget, _best(method, budget, bench, told, lights, truth, found))
        except NearfarError as error:
            found.failures.append(Failure(method, _counted(budget), str(error)))
        told(1.0)
        if on_trial is not None:
            on_trial(found.comparison(is_finished=number + 1 == len(jobs)))
    return found.comparison(is_finished=True)


class _Found:
    """What a comparison has found so far."""

    def __init__(self, scene: KnownTransport, left_out: tuple[LeftOut, ...]) -> None:
        self.scene = scene
        self.left_out = left_out
        self.trials: list[tuple[Budget, Trial]] = []
        self.failures: list[Failure] = []
        # Where a method took every photo of its budget, as much total exposure gives the same
        # photos.
        self.same: dict[tuple[str, Budget], Trial] = {}

    def add(self, method: str, budget: Budget, trials: Sequence[Trial]) -> None:
        """Keep the best of a method's trials at a budget."""
        if not trials:
            return
        best = max(trials, key=lambda trial: trial.pictures)
        self.trials.append((budget, best))
        took_all = all(trial.photos == budget.photos for trial in trials)
        if took_all and budget.total_exposure is None:
            self.same[method, Budget(budget.photos, budget.photos)] = best

    def comparison(self, *, is_finished: bool) -> Comparison:
        """Return all of it."""
        return Comparison(
            self.scene.name,
            self.scene.projector,
            self.scene.camera,
            tuple(trial for budget, trial in self.trials if budget.total_exposure is None),
            tuple(trial for budget, trial in self.trials if budget.total_exposure is not None),
            tuple(self.failures),
            is_finished,
            self.left_out,
        )


def _best(
    method: str,
    budget: Budget,
    bench: Bench,
    told: Callable[[float], None],
    lights: Mapping[str, Floats],
    truth: Mapping[str, Floats],
    found: _Found,
) -> list[Trial]:
    """Try a method at a budget, or take the trial that saw the same photos."""
    if (method, budget) in found.same:
        return [found.same[method, budget]]
    bench = replace(bench, progress=told)
    attempts = RIVALS[method].attempts(bench, budget)
    return [_judge(method, budget, attempt, lights, truth) for attempt in attempts]


def _of_method(
    report: Report, jobs: Sequence[tuple[str, Budget]], number: int
) -> Callable[[float], None]:
    """Return a function that reports the share of a method's work, given that of one job."""
    method = jobs[number][0]
    mine = [place for place, (name, _) in enumerate(jobs) if name == method]
    title, before = RIVALS[method].title, mine.index(number)
    return lambda share: report(title, (before + share) / len(mine))


def _counted(budget: Budget) -> int:
    """Return a budget as a number: of photos, or the total exposure in units of one photo's."""
    return budget.photos if budget.total_exposure is None else budget.total_exposure


def known_budgets(projector: Size, budgets: Sequence[int] | None) -> list[int]:
    """Return the budgets to compare at, rising, the default ones if none are given.

    Raises
    ------
    InputError
        If one is too small for any method.
    """
    chosen = sorted(set(default_budgets(projector) if budgets is None else budgets))
    if not chosen or chosen[0] < FEWEST_PHOTOS:
        raise InputError(
            f"a budget of {chosen[0] if chosen else 'no'} photos is too small to compare: "
            f"choose budgets of {FEWEST_PHOTOS} photos or more."
        )
    return chosen


def describe_work(scene: KnownTransport, methods: Sequence[str], budgets: Sequence[int]) -> str:
    """Return in a line what `compare` is about to do; raises as it does."""
    methods, _ = suited(scene, methods)
    jobs = _jobs(scene.projector, methods, budgets)
    titles = ", ".join(RIVALS[method].title for method in methods)
    counts = ", ".join(map(str, budgets))
    return (
        f"{scene.name}, projector {scene.projector}, camera {scene.camera}: {titles}, each at "
        f"{counts} photos and at equal total exposure, {len(jobs)} runs in all"
    )


def known_methods(methods: Sequence[str] | None) -> tuple[str, ...]:
    """Return methods to compare, all if none are named; raises as `compare`."""
    chosen = tuple(RIVALS if methods is None else methods)
    unknown = [name for name in chosen if name not in RIVALS]
    if unknown or not chosen:
        raise InputError(
            f"there is no method {', '.join(unknown) or 'to compare'}: choose from "
            f"{', '.join(RIVALS)}."
        )
    return chosen


def suited(
    scene: KnownTransport, methods: Sequence[str]
) -> tuple[tuple[str, ...], tuple[LeftOut, ...]]:
    """Return the methods that can run on a scene, and those that cannot, with the reason.

    Raises
    ------
    InputError
        If none can.
    """
    left_out = []
    for method in methods:
        unsuited = RIVALS[method].unsuited
        reason = None if unsuited is None else unsuited(scene)
        if reason is not None:
            left_out.append(LeftOut(method, reason))
    others = tuple(name for name in methods if name not in {name for name, _ in left_out})
    if not others:
        reasons = "; ".join(f"{RIVALS[name].title} {reason}" for name, reason in left_out)
        raise InputError(f"no method is left to compare: {reasons}. Name others.")
    return others, tuple(left_out)


def _jobs(
    projector: Size, methods: Sequence[str], budgets: Sequence[int]
) -> list[tuple[str, Budget]]:
    """List what to run: at equal photos, and each method's longest plan at equal exposure."""
    fixed = {method: count(projector) for method in methods if (count := RIVALS[method].photos)}
    totals = sorted({*budgets, *([max(fixed.values())] if fixed else [])})
    jobs = []
    for method in methods:
        counts = [fixed[method]] if method in fixed else budgets
        jobs += [(method, Budget(photos)) for photos in counts]
        jobs += [(method, Budget(counts[-1], total)) for total in totals]
    return jobs


def _judge(
    method: str,
    budget: Budget,
    attempt: Attempt,
    lights: Mapping[str, Floats],
    truth: Mapping[str, Floats],
) -> Trial:
    """Relight under all lights and compare with the truth."""
    values = {
        name: snr(truth[name], (attempt.transport @ light).reshape(truth[name].shape))
        for name, light in lights.items()
    }
    pictures = [value for name, value in values.items() if name.startswith("picture")]
    return Trial(
        method,
        _counted(budget),
        attempt.photos,
        attempt.photos * budget.exposure(attempt.photos)
        if attempt.exposure is None
        else attempt.exposure,
        float(np.mean(pictures)),
        values["white"],
        values["random"],
    )
