"""The demo: a plan, a noisy capture, its reconstruction, an evaluation, and a report."""

import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from nearfar.arrays import Size
from nearfar.files import new_output
from nearfar.illumination.pictures import natural_picture, penguin, white
from nearfar.plan import choose_plan
from nearfar.report.demo_page import demo_page
from nearfar.rigs.opening import open_rig
from nearfar.scenes.cache import cached_scene
from nearfar.transport.store import save_transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.evaluate import row_snr
from nearfar.workflow.judge import judge_by_truth
from nearfar.workflow.reconstruction.reconstruct import reconstruct
from nearfar.workflow.verdict.keeping import judge_transport

SCENE = "cornell"
PROJECTOR = Size(64, 64)
# A quarter of what the paper's plan takes, and about as accurate.
PHOTOS = 117

PLAN, CAPTURE, TRANSPORT, REPORT = "plan.json", "capture.zarr", "transport.zarr", "report.html"
NUMBERS = "numbers.json"


def is_demo(folder: Path) -> bool:
    """Return whether a folder holds a demo's outputs and nothing else."""
    names = {PLAN, CAPTURE, TRANSPORT, REPORT, NUMBERS}
    return all(entry.name in names for entry in folder.iterdir())


def run_demo(
    output: Path,
    *,
    force: bool = False,
    progress: Callable[[str, float], None] | None = None,
    command: str | None = None,
) -> dict[str, Any]:
    """Run all steps on the built-in Cornell scene and write a report.

    Parameters
    ----------
    output : Path
        Folder to create, for the plan, the capture, the transport, ``report.html``, and the figures
        as ``numbers.json``.
    force : bool
        Whether to replace the folder of an earlier demo.
    progress : callable, optional
        Called with the name of a step and the share of it that is done.
    command : str, optional
        As `nearfar.report.page.page` takes it.

    Returns
    -------
    dict
        As `nearfar.workflow.judge.judge_by_truth`.

    Raises
    ------
    NearfarError
        As `nearfar.files.new_output`.
    """
    report = progress or (lambda _step, _share: None)
    seconds: dict[str, float] = {}

    @contextmanager
    def timed(step: str) -> Iterator[None]:
        start = time.monotonic()
        yield
        seconds[step] = time.monotonic() - start

    with new_output(output, force=force, replaceable=is_demo) as partial:
        partial.mkdir()
        plan, _ = choose_plan(PROJECTOR, PHOTOS, progress=report)
        (partial / PLAN).write_text(plan.to_json(), encoding="utf-8")
        with timed("scene"):
            truth = cached_scene(SCENE, PROJECTOR, progress=report)
        with timed("photos"):
            rig = open_rig(SCENE, PROJECTOR)
            capture = acquire(plan, partial / CAPTURE, rig, progress=report)
        with timed("reconstruction"):
            transport, correspondence = reconstruct(capture, progress=report)
        save_transport(transport, partial / TRANSPORT)
        with timed("verdict"):
            verdict = judge_transport(partial / TRANSPORT, capture, progress=report).kept
        with timed("evaluation"):
            judgement = judge_by_truth(transport, truth, progress=report)
            rows = row_snr(transport, truth)
        (partial / NUMBERS).write_text(json.dumps(judgement, indent=2), encoding="utf-8")
        lights = {
            "floodlight": white(PROJECTOR),
            "penguin": penguin(PROJECTOR),
            "leaves": natural_picture(PROJECTOR, 1, colour=True),
        }
        text = demo_page(
            plan,
            transport,
            truth,
            correspondence,
            lights,
            judgement,
            rows,
            verdict,
            seconds,
            command,
        )
        (partial / REPORT).write_text(text, encoding="utf-8")
    return judgement
