"""What plans of every kind tell of a transport: held-out SNR_b beside the true one.

Run ``python benchmarks/checks_of_plans.py [SIDE ...]``. Captures are of the Cornell box, good ones
and spoilt ones. For each plan and method it prints the number of photos, held-out and true SNR_b
of the same lights, that of natural pictures, what the error bars expected, and the verdict.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from nearfar import Plan, Size, choose_plan, natural_picture, paper_plan, reconstruct_to_file
from nearfar.arrays import Floats
from nearfar.capture.writing import write_capture
from nearfar.plan.checks import check_lights
from nearfar.transport.model import Transport
from nearfar.transport.stored import open_transport
from nearfar.workflow.evaluate import decibels, exposure_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.verdict.correspondence_lights import correspondence_lights
from nearfar.workflow.verdict.verdict import judge_reconstruction
from spoils import SPOILS, Shot, shoot_plan

PICTURES = 4
SPOILT = (("gamma", 1.1), ("camera moved, pixels", 0.3))


def plans(side: int) -> dict[str, Plan]:
    """Return plans of every kind, by name."""
    projector = Size(side, side)
    window, far = (9, (7, 7)) if side < 32 else (11, (9, 9))
    found = {"--photos": choose_plan(projector, 5 * side)[0]}
    for offset in ("inverse", "reference"):
        for correspondence in ("stripes", "gray", "phase"):
            found[f"--offset {offset} --correspondence {correspondence}"] = paper_plan(
                projector, window, far, offset=offset, correspondence=correspondence
            )
    return found


def true_snr(shot: Shot, transport: Transport, lights: list[Floats]) -> float:
    """Mean of the true SNR_b under some lights."""
    exposure = np.float32(exposure_of(transport, shot.truth).factor)
    found = []
    for light in lights:
        known, relit = exposure * (shot.truth @ light).ravel(), (transport @ light).ravel()
        found.append(decibels(float(known @ known), float(np.sum((known - relit) ** 2))))
    return float(np.mean(found)) if found else float("nan")


def lights_of(plan: Plan, *, is_fine: bool) -> list[Floats]:
    """Return the lights that a plan's transport is checked by."""
    checks = [light.pattern.draw(plan.projector) / np.float32(255) for light in check_lights(plan)]
    if checks:
        return [] if is_fine else checks
    return [each.light for each in correspondence_lights(plan) if each.is_fine == is_fine]


def table(side: int, method: str) -> None:
    """Print the table of one projector and one method."""
    for name, plan in plans(side).items():
        shot = shoot_plan("cornell", plan)
        ways = [("good", shot.photos)]
        ways += [(f"{w} {s:g}", SPOILS[w].apply(shot, s)) for w, s in SPOILT]
        for what, photos in ways:
            with tempfile.TemporaryDirectory() as folder:
                capture = write_capture(
                    plan, Path(folder) / "c.zarr", list(photos), full_scale=shot.full_scale
                )
                options = ReconstructionOptions(method=method)
                reconstruct_to_file(capture, Path(folder) / "t.zarr", options=options)
                stored = open_transport(Path(folder) / "t.zarr")
                verdict = judge_reconstruction(stored, capture)
                transport = stored.rows()
            pictures = [natural_picture(plan.projector, seed) for seed in range(PICTURES)]
            print(f"{side} {method} {name}, {len(plan.patterns)} photos, {what}")
            held_out = verdict.held_out
            for lights, called in ((False, "coarse"), (True, "fine")):
                of_kind = held_out and (held_out.fine if lights else held_out.lights)
                if not of_kind or held_out is None:
                    continue
                true = true_snr(shot, transport, lights_of(plan, is_fine=lights))
                each = [f"{light.snr:.1f}" for light in of_kind]
                both = type(held_out)(of_kind)
                print(
                    f"    {called}: held out {both.snr:.1f}, true {true:.1f}, expected "
                    f"{both.expected_snr}, error ratio {both.error_ratio}, {' '.join(each)}"
                )
            print(f"    pictures: true {true_snr(shot, transport, pictures):.1f}")
            print(f"    {verdict}", flush=True)


def main() -> None:
    """Print the tables."""
    for side in [int(text) for text in sys.argv[1:]] or [24, 32]:
        for method in ("joint", "paper"):
            table(side, method)


if __name__ == "__main__":
    main()
