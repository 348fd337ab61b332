"""Methods side by side: at equal numbers of photos, and at equal total exposure.

Every method sees the same scene, camera and noise. Photos count all that is shown: stripes,
inverses, references, black. One unit of exposure is a photo in which the brightest camera pixel
comes to the full well under white; at equal total exposure a method of fewer photos exposes each
for longer, its well as much deeper, and a method of many for less.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.baselines.brute_force import BruteForce
from nearfar.baselines.choosing import best_share
from nearfar.baselines.compressive import reconstruct_compressive
from nearfar.baselines.hadamard import Hadamard
from nearfar.baselines.random_patterns import bernoulli_patterns, measure_by_rig
from nearfar.baselines.reference import Acquisition, acquire_reference
from nearfar.correspondence import correspond_by_phase, correspond_by_stripes
from nearfar.errors import InputError, PlanError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.paper import estimate
from nearfar.illumination.pictures import standard_lights
from nearfar.photometry.measure import measure
from nearfar.plan import Plan, choose_plan, paper_plan
from nearfar.plan.choose import FEWEST_PHOTOS, NOISE, default_window
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.opening import choose_exposure
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact import ExactTransport
from nearfar.workflow.acquire import hold
from nearfar.workflow.evaluate import snr

METHODS = ("joint", "paper", "CLT", "Hadamard", "brute force")
# Sides of the paper's far band, as multiples of P/W on each axis: its best is taken.
BANDS = (1.0, 1.2, 2.0)
# The default budgets, as shares of the paper's photos.
SHARES = (16, 8, 4, 2, 1)
# Brute force takes black once for so many projector pixels.
BLACK_EVERY = 16

Report = Callable[[str, float], None]


class Linear(Protocol):
    """Whatever relights."""

    def __matmul__(self, light: Floats) -> Floats:
        """Picture under a light."""
        ...


class Trial(NamedTuple):
    """How one method fared.

    Attributes
    ----------
    method : str
        Of `METHODS`.
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
        Of plans of one length for each method, the total exposure being that of a budget.
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


class _Bench(NamedTuple):
    """What all trials share."""

    scene: ExactTransport
    truth: Mapping[str, Floats]
    lights: Mapping[str, Floats]
    camera: SimulatedCamera
    window: int
    # Photo units per unit of the scene's transport.
    gain: float

    def rig(self, exposure: float) -> SimulatedRig:
        """Make a rig whose photos are exposed so many times as long."""
        camera = self.camera.model_copy(update={"full_well": self.camera.full_well * exposure})
        return SimulatedRig(self.scene, self.scene.name, SimulatedProjector(), camera, self.gain, 0)

    def trial(self, job: "_Job", photos: int, found: Linear) -> Trial:
        """Relight under all lights."""
        values = {
            name: snr(self.truth[name], (found @ light).reshape(self.truth[name].shape))
            for name, light in self.lights.items()
        }
        pictures = [value for name, value in values.items() if name.startswith("picture")]
        return Trial(
            job.method,
            job.budget,
            photos,
            photos * job.exposure(photos),
            float(np.mean(pictures)),
            values["white"],
            values["random"],
        )


class _Job(NamedTuple):
    """A method, the photos that it may take, and the total exposure that they share.

    Without a total each photo is exposed alike.
    """

    method: str
    photos: int
    total: int | None = None

    @property
    def budget(self) -> int:
        return self.photos if self.total is None else self.total

    def exposure(self, photos: int) -> float:
        """Exposure of each of the photos that are really taken."""
        return 1.0 if self.total is None else self.total / photos


def default_budgets(projector: Size) -> tuple[int, ...]:
    """Shares of the photos of the paper's plan with a default window, the largest last."""
    window = default_window(projector)
    total = len(paper_plan(projector, window, _band(projector, window, BANDS[1])).patterns)
    return tuple(total // share for share in SHARES if total // share >= FEWEST_PHOTOS)


def compare(
    scene: ExactTransport,
    budgets: Sequence[int] | None = None,
    *,
    methods: Sequence[str] = METHODS,
    window: int | None = None,
    camera: SimulatedCamera | None = None,
    progress: Report | None = None,
) -> Comparison:
    """Run methods on a scene at several budgets of photos, and of total exposure.

    The rivals are given their best: the paper's method the better of several bands at each budget,
    compressive light transport the regularisation that the truth likes best. Correspondence is
    found by each method itself.

    Parameters
    ----------
    scene : ExactTransport
    budgets : sequence of int, optional
        Numbers of photos; `default_budgets` if left out.
    methods : sequence of str
        Of `METHODS`.
    window : int, optional
        W of the joint estimate's plans; `default_window` if left out.
    camera : SimulatedCamera, optional
    progress : callable, optional
        Told what is being done and the share done.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        If there is no such method, or no budget that is enough for any.
    """
    unknown = [name for name in methods if name not in METHODS]
    if unknown or not methods:
        raise InputError(
            f"there is no method {', '.join(unknown) or 'to compare'}: choose from "
            f"{', '.join(METHODS)}."
        )
    budgets = sorted(set(default_budgets(scene.projector) if budgets is None else budgets))
    if not budgets or budgets[0] < FEWEST_PHOTOS:
        raise InputError(
            f"a budget of {budgets[0] if budgets else 'no'} photos is too small to compare: "
            f"choose budgets of {FEWEST_PHOTOS} photos or more."
        )
    lights = standard_lights(scene.projector)
    gain = choose_exposure(None, scene, scene.name)
    bench = _Bench(
        scene,
        {name: np.float32(gain) * (scene @ light) for name, light in lights.items()},
        lights,
        camera or SimulatedCamera(),
        default_window(scene.projector) if window is None else window,
        gain,
    )
    report = progress or (lambda _what, _share: None)
    jobs = _jobs(scene.projector, methods, budgets)
    done: list[tuple[_Job, Trial]] = []
    for number, job in enumerate(jobs):
        report(job.method, number / len(jobs))
        trial = _RUN[job.method](bench, job)
        if trial is not None:
            done.append((job, trial))
    report("compared", 1.0)
    return Comparison(
        scene.name,
        scene.projector,
        scene.camera,
        tuple(trial for job, trial in done if job.total is None),
        tuple(trial for job, trial in done if job.total is not None),
    )


def _jobs(projector: Size, methods: Sequence[str], budgets: Sequence[int]) -> list[_Job]:
    """List what to run: at equal photos, and each method's longest plan at equal exposure."""
    fixed = {m: _FIXED[m](projector).photos for m in methods if m in _FIXED}
    totals = sorted({*budgets, *([max(fixed.values())] if fixed else [])})
    jobs = []
    for method in methods:
        counts = [fixed[method]] if method in fixed else budgets
        jobs += [_Job(method, photos) for photos in counts]
        jobs += [_Job(method, counts[-1], total) for total in totals]
    return jobs


def _jointly(bench: _Bench, job: _Job) -> Trial:
    noise = NOISE / np.sqrt(job.exposure(job.photos))
    projector = bench.scene.projector
    plan, _ = choose_plan(projector, job.photos, window=bench.window, noise=float(noise))
    photos = len(plan.patterns)
    measurements = measure(hold(plan, bench.rig(job.exposure(photos))))
    q = correspond_by_phase(measurements).q
    found = estimate_jointly(measurements, q, plan.window, plan.far)
    return bench.trial(job, photos, found)


def _as_the_paper(bench: _Bench, job: _Job) -> Trial | None:
    best: Trial | None = None
    for plan in paper_plans(bench.scene.projector, job.photos):
        photos = len(plan.patterns)
        held = hold(plan, bench.rig(job.exposure(photos)))
        q = correspond_by_stripes(held).q
        if not np.isfinite(q).any():
            continue
        found = estimate(measure(held), q, plan.window, plan.far, plan.dropped)
        trial = bench.trial(job, photos, found)
        if best is None or trial.pictures > best.pictures:
            best = trial
    return best


def _compressively(bench: _Bench, job: _Job) -> Trial:
    patterns = bernoulli_patterns(bench.scene.projector, job.photos - 1, 0)
    measurements = measure_by_rig(bench.rig(job.exposure(job.photos)), patterns)
    choice = best_share(measurements, bench.scene, exposure=bench.gain)
    found = reconstruct_compressive(measurements, choice.share, refitted=choice.is_refitted)
    return bench.trial(job, measurements.photos, found)


def _by_reference(bench: _Bench, job: _Job) -> Trial:
    acquisition = _FIXED[job.method](bench.scene.projector)
    found = acquire_reference(acquisition, bench.rig(job.exposure(acquisition.photos)))
    return bench.trial(job, acquisition.photos, found)


def _brute_force(projector: Size) -> Acquisition:
    # Black's error is in every entry: under white it would weigh P times as much as one photo's.
    return BruteForce(projector, blacks=max(1, projector.pixels // BLACK_EVERY))


_FIXED: Mapping[str, Callable[[Size], Acquisition]] = {
    "Hadamard": Hadamard,
    "brute force": _brute_force,
}
_RUN: Mapping[str, Callable[[_Bench, _Job], Trial | None]] = {
    "joint": _jointly,
    "paper": _as_the_paper,
    "CLT": _compressively,
    **dict.fromkeys(_FIXED, _by_reference),
}


def paper_plans(projector: Size, photos: int) -> list[Plan]:
    """List the paper's plans with the largest W that a number of photos allows, one for each band.

    Inverse pairs and stripes; empty where the photos are too few for any.
    """
    found: dict[tuple[int, Size], Plan] = {}
    for times in BANDS:
        for window in range(2 * ((min(projector) - 1) // 2) - 1, 2, -2):
            band = _band(projector, window, times)
            # W^2 pairs at the least: no need to plan what cannot fit.
            if 2 * window**2 + sum(projector) > photos:
                continue
            try:
                plan = paper_plan(projector, window, band)
            except PlanError:
                continue
            if len(plan.patterns) <= photos:
                found[(window, band)] = plan
                break
    return list(found.values())


def _band(projector: Size, window: int, times: float) -> Size:
    """Odd sides of a far band, so many times P/W on each axis."""
    return Size(
        *(
            max(1, min(2 * round((times * side / window - 1) / 2) + 1, side - 1 + side % 2))
            for side in projector
        )
    )
