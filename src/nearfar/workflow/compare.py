"""Methods side by side: at equal numbers of photos, and at equal total exposure.

Every method sees the same scene, camera and noise. All photos count: stripes, inverses, references
and black too. One unit of exposure is a photo in which the brightest camera pixel comes to the full
well under white. At equal total exposure a method with fewer photos exposes each for longer, with a
full well deeper in proportion, and a method with many for less.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.callbacks import Report
from nearfar.errors import InputError
from nearfar.illumination.pictures import standard_lights
from nearfar.plan.choose import FEWEST_PHOTOS, default_window
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.opening import choose_exposure
from nearfar.transport.exact import ExactTransport
from nearfar.workflow.evaluate import snr
from nearfar.workflow.rivals import RIVALS
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.paper import default_photos
from nearfar.workflow.rivals.rival import Attempt, Budget

# A default budget is the paper's photos divided by one of these.
BUDGET_DIVISORS = (16, 8, 4, 2, 1)


class Trial(NamedTuple):
    """Result of one method at one budget.

    Attributes
    ----------
    method : str
        Of `nearfar.workflow.rivals.RIVALS`.
    budget : int
        Photos, or total exposure, that were allowed.
    photos : int
        All that were taken.
    exposure : float
        Total, in units of one photo's at the camera's own setting.
    pictures, white, random : float
        SNR_b in dB; of pictures the mean over five.
    """

    method: str
    budget: int
    photos: int
    exposure: float
    pictures: float
    white: float
    random: float


@dataclass(frozen=True)
class Comparison:
    """Trials of one scene.

    Attributes
    ----------
    scene : str
    projector, camera : Size
    equal_photos : tuple of Trial
        Each photo exposed alike.
    equal_exposure : tuple of Trial
        Each method's longest plan, at each budget of total exposure.
    """

    scene: str
    projector: Size
    camera: Size
    equal_photos: tuple[Trial, ...]
    equal_exposure: tuple[Trial, ...]

    def numbers(self) -> dict[str, Any]:
        """Return everything as JSON holds it."""
        return {
            "scene": self.scene,
            "projector": list(self.projector),
            "camera": list(self.camera),
            "equal_photos": [trial._asdict() for trial in self.equal_photos],
            "equal_exposure": [trial._asdict() for trial in self.equal_exposure],
        }


def default_budgets(projector: Size) -> tuple[int, ...]:
    """Return shares of the photos of the paper's plan with a default window, the largest last."""
    total = default_photos(projector)
    return tuple(total // part for part in BUDGET_DIVISORS if total // part >= FEWEST_PHOTOS)


def compare(
    scene: ExactTransport,
    budgets: Sequence[int] | None = None,
    *,
    methods: Sequence[str] | None = None,
    window: int | None = None,
    camera: SimulatedCamera | None = None,
    progress: Report | None = None,
) -> Comparison:
    """Run methods on a scene at several budgets of photos, and of total exposure.

    The rivals are given their best: at each budget, the paper's method has the best of several far
    bands, and compressive light transport the regularisation that fits the truth best.
    Correspondence is found by each method itself.

    Parameters
    ----------
    scene : ExactTransport
    budgets : sequence of int, optional
        Numbers of photos; `default_budgets` if left out.
    methods : sequence of str, optional
        Of `nearfar.workflow.rivals.RIVALS`; all if left out.
    window : int, optional
        W of the joint estimate's plans; `default_window` if left out.
    camera : SimulatedCamera, optional
    progress : callable, optional
        Called with what is being done and the share done, 0 to 1.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        If there is no such method, or no budget that is enough for any.
    """
    methods = known_methods(methods)
    budgets = sorted(set(default_budgets(scene.projector) if budgets is None else budgets))
    if not budgets or budgets[0] < FEWEST_PHOTOS:
        raise InputError(
            f"a budget of {budgets[0] if budgets else 'no'} photos is too small to compare: "
            f"choose budgets of {FEWEST_PHOTOS} photos or more."
        )
    lights = standard_lights(scene.projector)
    gain = choose_exposure(None, scene, scene.name)
    truth = {name: np.float32(gain) * (scene @ light) for name, light in lights.items()}
    bench = Bench(
        scene,
        camera or SimulatedCamera(),
        default_window(scene.projector) if window is None else window,
        gain,
    )
    report = progress or (lambda _what, _share: None)
    jobs = _jobs(scene.projector, methods, budgets)
    done: list[tuple[Budget, Trial]] = []
    # Where a method took every photo of its budget, as much total exposure gives the same photos.
    same: dict[tuple[str, Budget], Trial] = {}
    for number, (method, budget) in enumerate(jobs):
        report("comparing", number / len(jobs))
        if (method, budget) in same:
            done.append((budget, same[method, budget]))
            continue
        trials = [
            _judge(method, budget, attempt, lights, truth)
            for attempt in RIVALS[method].attempts(bench, budget)
        ]
        if trials:
            best = max(trials, key=lambda trial: trial.pictures)
            done.append((budget, best))
            took_all = all(trial.photos == budget.photos for trial in trials)
            if took_all and budget.total_exposure is None:
                same[method, Budget(budget.photos, budget.photos)] = best
    report("compared", 1.0)
    return Comparison(
        scene.name,
        scene.projector,
        scene.camera,
        tuple(trial for budget, trial in done if budget.total_exposure is None),
        tuple(trial for budget, trial in done if budget.total_exposure is not None),
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
        budget.photos if budget.total_exposure is None else budget.total_exposure,
        attempt.photos,
        attempt.photos * budget.exposure(attempt.photos),
        float(np.mean(pictures)),
        values["white"],
        values["random"],
    )
