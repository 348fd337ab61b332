"""Fit the prior components and the planner's typical scenes again, and say how far they move.

Run ``python benchmarks/refit_priors.py [--quick] [--pixels N] [SCENE ...]``. Nothing is changed:
tables that should move are to be edited in nearfar/priors/fitted.py by hand.

Each scene is photographed by the camera of benchmarks/accuracy.py with a plan of a quarter of the
paper's photos, q given, and N of its lit camera pixels are drawn. The log evidence of each of 240
candidates, at its best prior scale, is computed at all of them. Components are chosen one by one,
each time the one that raises the sum of every camera pixel's best log evidence most. Printed are
the components in the order of choice, and the mean log evidence per camera pixel that is lost
against all 240.

Typical scenes are mixtures of the standing components by the squared light of the drawn camera
pixels: the box, the wedge and the corner together by component, and the corner alone by component
and two octaves of prior scale. Printed is the share of light that moves between rows, beside the
share that moves between two halves of the pixels, and by how many octaves prior scales move.

``--quick`` takes smaller versions of the scenes, which are computed in a minute, and 100 camera
pixels of each. Reaches count in projector pixels, so components that fit small scenes are others:
quick figures show that the fit runs, not how good the table is.
"""

import argparse
from itertools import product
from typing import NamedTuple

import numpy as np

from accuracy import shoot
from fewer_photos import CASES
from nearfar import ExactTransport, Size, choose_plan, paper_plan
from nearfar.arrays import Floats, Integers
from nearfar.estimate.joint.batch import PixelBatch, gather
from nearfar.estimate.joint.evidence import log_evidence, whiten
from nearfar.estimate.joint.problem import Model, lay_out
from nearfar.illumination.near_basis import NearBasis
from nearfar.photometry.measure import measure
from nearfar.plan.choose_frequencies import choose_frequencies
from nearfar.priors.component import PriorComponent
from nearfar.priors.fitted import FREE, LIT_COMPONENTS, PRIOR_SCALES, TYPICAL_SCENES
from nearfar.priors.responses import response_prior
from nearfar.priors.typical import TypicalScenes, typical_scenes
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene

SCENES = ("cornell", "cornell-aside", "wedge", "corner")
SMALL = {"cornell": Size(32, 32), "cornell-aside": Size(32, 32), "wedge": Size(34, 50)}
SMALL |= {"corner": Size(32, 32)}
PIXELS, QUICK_PIXELS = 500, 100
PAPER_SHARE = 4
# The record names ranges and counts; the steps are those of the table, and the sixth far deviation
# is a guess.
NEAR_REACHES = (0.8, 1.3, 2.2, 3.5, 6.0)
FAR_DEVIATIONS = (0.25, 1.0, 4.0, 16.0, 64.0, 256.0)
FAR_DECAYS = (0.7, 1.5, 3.0, 8.0)
DIRECT_SPREADS = (0.0, 3.0)
CANDIDATES = tuple(
    PriorComponent(*values)
    for values in product(NEAR_REACHES, FAR_DEVIATIONS, FAR_DECAYS, DIRECT_SPREADS)
)
# Those of the table that were chosen, not added by hand.
STANDING = tuple(one for one in LIT_COMPONENTS if not one.roughness and one.far_decay < FREE)
# Scenes of each row of the planner's table, and octaves of prior scale that make one row.
TYPICAL = ((("cornell", "wedge", "corner"), len(PRIOR_SCALES)), (("corner",), 2))
# What the planner's table leaves out of either scene.
SHARE_FLOORS = (0.04, 0.003)


class Fits(NamedTuple):
    """Log evidence of components at camera pixels, and their best prior scales.

    Attributes
    ----------
    evidence : ndarray, shape (components, n)
    octave : ndarray of int, shape (components, n)
        Place of the best prior scale.
    energy : ndarray, shape (n,)
        Squared light under white.
    """

    evidence: Floats
    octave: Integers
    energy: Floats


def drawn_pixels(
    scene: ExactTransport, window: int, photos: int, count: int
) -> tuple[PixelBatch, Model]:
    """Photograph a scene, and gather some of its lit camera pixels."""
    plan, _ = choose_plan(scene.projector, photos, window=window, checks=0)
    measurements = measure(shoot(plan, scene, SimulatedCamera()))
    problem = lay_out(measurements, scene.correspondence, NearBasis(window), "cpu")
    lit = np.flatnonzero(problem.pixels.lit)
    selected = np.random.default_rng(0).choice(lit, min(count, len(lit)), replace=False)
    return gather(problem.pixels, selected, problem.model.centred, scene.projector), problem.model


def fit(batch: PixelBatch, model: Model, components: tuple[PriorComponent, ...]) -> Fits:
    """Compute the log evidence of components at their best prior scales."""
    whitened = whiten(batch)
    found = [
        log_evidence(whitened, response_prior(one, model.centred, model.multiplicity))
        for one in components
    ]
    energy = np.mean(batch.white.astype(np.float64) ** 2, axis=1)
    return Fits(
        np.stack([each.max(axis=1) for each in found]).astype(np.float64),
        np.stack([each.argmax(axis=1) for each in found]),
        energy,
    )


def fit_scene(name: str, count: int, small: bool) -> tuple[Fits, Fits]:
    """Fit the candidates, and the standing table, to camera pixels of a scene."""
    window, far = CASES[name]
    scene = cached_scene(name, SMALL[name] if small else None)
    photos = len(paper_plan(scene.projector, window, far).patterns) // PAPER_SHARE
    batch, model = drawn_pixels(scene, window, photos, count)
    print(f"{name}: {scene.projector}, {photos} photos, {len(batch.lit)} camera pixels", flush=True)
    return fit(batch, model, CANDIDATES), fit(batch, model, LIT_COMPONENTS)


def chosen_in_turn(evidence: Floats, count: int) -> list[int]:
    """Choose components one by one, each the one that raises the evidence most."""
    best = np.full(evidence.shape[1], -np.inf)
    found: list[int] = []
    for _ in range(count):
        found.append(int(np.argmax(np.maximum(evidence, best).sum(axis=1))))
        best = np.maximum(best, evidence[found[-1]])
    return found


def lost(evidence: Floats, chosen: list[int]) -> float:
    """Return the mean log evidence lost against all candidates."""
    return float(np.mean(evidence.max(axis=0) - evidence[chosen].max(axis=0)))


def report_components(evidence: Floats) -> None:
    """Print the components chosen again beside those that stand."""
    standing = [CANDIDATES.index(one) for one in STANDING]
    again = chosen_in_turn(evidence, len(standing))
    print(f"\n{'chosen again':44s} in the table")
    for number, place in enumerate(again):
        one = CANDIDATES[place]
        rank = f"as number {standing.index(place) + 1}" if place in standing else "not"
        values = f"reach {one.near_reach}, far {one.far_deviation:g}, decay {one.far_decay}"
        print(f"{number + 1:2d}  {values}, spread {one.direct_spread:g}".ljust(44), rank)
    print(f"{len(set(again) & set(standing))} of {len(standing)} stand")
    for count in (4, 8, 16, len(standing)):
        by_table, by_choice = (lost(evidence, one[:count]) for one in (standing, again))
        print(
            f"log evidence lost against all {len(CANDIDATES)} by {count:2d}: the table "
            f"{by_table:.2f}, chosen again {by_choice:.2f}"
        )


def mixture(
    fits: list[Fits], octaves: int, halves: tuple[int, ...]
) -> dict[tuple[int, int], Floats]:
    """Return (share of squared light, mean square prior scale) by component and octaves.

    Parameters
    ----------
    fits : list of Fits
        Of LIT_COMPONENTS, of scenes that count alike.
    octaves : int
        Of prior scale that are put together.
    halves : tuple of int
        Which of every two camera pixels count: 0, 1 or both.
    """
    found: dict[tuple[int, int], Floats] = {}
    for one in fits:
        mine = np.flatnonzero(np.isin(np.arange(len(one.energy)) % 2, halves))
        best = one.evidence[:, mine].argmax(axis=0)
        octave = one.octave[best, mine]
        share = one.energy[mine] / one.energy[mine].sum() / len(fits)
        for component, step, part in zip(best, octave, share, strict=True):
            values = np.array([part, part * PRIOR_SCALES[step] ** 2])
            key = int(component), int(step) // octaves
            found[key] = found.get(key, np.zeros(2)) + values
    return found


def table_of(standing: TypicalScenes, place: int, octaves: int) -> dict[tuple[int, int], Floats]:
    """Return a scene of the planner's table as `mixture` does."""
    found: dict[tuple[int, int], Floats] = {}
    shares = standing.shares[place] / standing.shares[place].sum()
    for (component, scale), share in zip(standing.prior_components, shares, strict=True):
        if share > 0:
            step = int(np.clip(np.rint(np.log2(scale / PRIOR_SCALES[0])), 0, len(PRIOR_SCALES) - 1))
            key = LIT_COMPONENTS.index(component), step // octaves
            found[key] = found.get(key, np.zeros(2)) + share * np.array([1.0, scale**2])
    return found


def moved(one: dict[tuple[int, int], Floats], other: dict[tuple[int, int], Floats]) -> float:
    """Return the share of light that moves between rows, in per cent."""
    nothing = np.zeros(2)
    rows = one.keys() | other.keys()
    return 50.0 * sum(abs(one.get(row, nothing)[0] - other.get(row, nothing)[0]) for row in rows)


def octaves_moved(
    one: dict[tuple[int, int], Floats], other: dict[tuple[int, int], Floats]
) -> float:
    """Return the mean distance of prior scales of rows in both, weighted by light, in octaves."""
    rows = sorted(one.keys() & other.keys())
    if not rows:
        return float("nan")
    squared = [[each[row][1] / each[row][0] for row in rows] for each in (one, other)]
    weights = [one[row][0] + other[row][0] for row in rows]
    return float(np.average(0.5 * np.abs(np.diff(np.log2(squared), axis=0))[0], weights=weights))


def report_typical(fits: dict[str, Fits]) -> None:
    """Print how far the planner's typical scenes move, and what plans make of it."""
    print()
    rows: list[tuple[PriorComponent, float, tuple[float, ...]]] = []
    for place, ((names, octaves), floor) in enumerate(zip(TYPICAL, SHARE_FLOORS, strict=True)):
        of_scenes = [fits[name] for name in names if name in fits]
        if len(of_scenes) < len(names):
            print(f"typical scene {place + 1} needs {', '.join(names)}: left out")
            continue
        again = mixture(of_scenes, octaves, (0, 1))
        table = table_of(TYPICAL_SCENES, place, octaves)
        between = moved(*(mixture(of_scenes, octaves, (half,)) for half in (0, 1)))
        print(
            f"typical scene {place + 1}: {moved(again, table):.0f} % of the light moves between "
            f"rows ({between:.0f} % between two halves of the pixels), prior scales by "
            f"{octaves_moved(again, table):.1f} octaves"
        )
        for (component, _), (share, squared) in again.items():
            shares = tuple(share * (place == number) for number in range(len(TYPICAL)))
            if share >= floor:
                rows.append((LIT_COMPONENTS[component], float(np.sqrt(squared / share)), shares))
    if all(name in fits for names, _ in TYPICAL for name in names):
        weights = tuple(float(weight) for weight in TYPICAL_SCENES.weights)
        report_plan(typical_scenes(weights, *rows))


def report_plan(again: TypicalScenes) -> None:
    """Print how much of a plan changes with the typical scenes."""
    plans = [
        choose_frequencies(Size(64, 64), 117, 11, typical=typical).frequencies
        for typical in (TYPICAL_SCENES, again)
    ]
    shared = sum(min(count, plans[1].get(k, 0)) for k, count in plans[0].items())
    print(
        f"a plan of 117 photos for 64x64 keeps {shared} of its {sum(plans[0].values())} "
        f"measurements"
    )


def main() -> None:
    """Fit what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=SCENES, metavar="SCENE")
    parser.add_argument("--quick", action="store_true", help="small scenes, few camera pixels")
    parser.add_argument("--pixels", type=int, help="camera pixels of each scene")
    asked = parser.parse_args()
    count = asked.pixels or (QUICK_PIXELS if asked.quick else PIXELS)
    fits = {name: fit_scene(name, count, asked.quick) for name in asked.scenes}
    report_components(
        np.concatenate([candidates.evidence for candidates, _ in fits.values()], axis=1)
    )
    report_typical({name: standing for name, (_, standing) in fits.items()})


if __name__ == "__main__":
    main()
