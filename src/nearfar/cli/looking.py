"""``nearfar evaluate`` and ``nearfar render``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from nearfar.arrays import Size
from nearfar.cli.options import (
    AsJson,
    Force,
    Quiet,
    ReportPath,
    ScenesCamera,
    ScenesProjector,
    TransportPath,
    keep_for_page,
    keep_input,
    scene_names,
)
from nearfar.cli.saying import say, warn
from nearfar.progress import Report, progress_bar

if TYPE_CHECKING:
    from nearfar.transport.exact import ExactTransport


def evaluate(
    transport: TransportPath,
    truth: Annotated[
        Path | None,
        typer.Option(help="What render wrote, or a dense T (.npy, .npz).", metavar="TRUTH"),
    ] = None,
    photos: Annotated[
        Path | None,
        typer.Option(
            help="Folder of pairs NAME.light.png, NAME.photo.tiff; a pair under an all-black "
            "light tells the black.",
            metavar="DIR",
        ),
    ] = None,
    full_scale: Annotated[
        float | None, typer.Option(help="Value of full scale of the photos.", metavar="VALUE")
    ] = None,
    report: ReportPath = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Measure a transport: SNR_b of relighting, SNR_t of rows, its components.

    Example: nearfar evaluate transport.zarr --truth truth.zarr --json
    """
    from nearfar.transport.exact_store import load_exact
    from nearfar.transport.store import load_transport
    from nearfar.workflow.evaluate import row_snr
    from nearfar.workflow.judge import (
        beside_photos,
        beside_truth,
        judge_by_truth,
        judge_pairs,
    )

    if (truth is None) == (photos is None):
        raise typer.BadParameter("give either --truth or --photos.", param_hint="--truth")
    if report is not None:
        keep_for_page(report, transport, *(path for path in (truth, photos) if path), force=force)
    with progress_bar("evaluating", quiet=quiet) as told:
        opened = load_transport(transport)
        if truth is not None:
            known = load_exact(truth, projector=opened.projector, camera=opened.camera)
            rows = row_snr(opened, known, progress=lambda share: told("rows", share))
            found = judge_by_truth(opened, known, rows, progress=told)
        else:
            assert photos is not None
            rows, pairs = None, beside_photos(opened, photos, full_scale=full_scale)
            found = judge_pairs(pairs)
        if report is not None:
            from nearfar.report.evaluation import evaluation_page
            from nearfar.report.page import write_page

            if truth is not None:
                pairs = beside_truth(opened, known)
            text = evaluation_page(opened, str(truth or photos), found, pairs, rows)
            write_page(report, text, force=force)
    if as_json:
        print(json.dumps(found, allow_nan=False))
    else:
        say(_lines(found), quiet=quiet)


def _lines(found: dict[str, Any], indent: str = "") -> str:
    lines = []
    for name, value in found.items():
        if isinstance(value, dict):
            lines += [f"{indent}{name}", _lines(value, indent + "  ")]
        else:
            shown = f"{value:8.2f} dB" if isinstance(value, float) else str(value)
            lines.append(f"{indent}{name:<14}{shown}")
    return "\n".join(lines)


def render(
    scene: Annotated[
        str,
        typer.Argument(
            metavar="SCENE",
            autocompletion=scene_names,
            help="cornell, cornell-aside, wedge, corner, alcove or shelf, or a Mitsuba 3 scene "
            "(.xml).",
        ),
    ],
    output: Annotated[Path, typer.Argument(metavar="OUT", help="Zarr to make.")],
    projector: ScenesProjector = None,
    camera: ScenesCamera = None,
    samples: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Paths per camera pixel of a Mitsuba scene; 4096 if left out."
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(metavar="N", min=0, help="Seed of those paths; 0 if left out."),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Compute a scene's transport: a built-in one's exactly, a Mitsuba scene's by path tracing.

    Components are apart for a built-in scene, together for a Mitsuba scene.

    Example: nearfar render cornell truth.zarr --projector 64x64
    """
    from nearfar.files import check_output
    from nearfar.rigs.config import is_mitsuba
    from nearfar.scenes import NAMES
    from nearfar.transport.exact_store import save_exact

    if scene not in NAMES:
        keep_input(output, Path(scene))
    check_output(output, force=force)
    from_file = is_mitsuba(Path(scene))
    if not from_file and (samples, seed) != (None, None):
        raise typer.BadParameter("a built-in scene is computed without chance.", param_hint=scene)
    with progress_bar("rendering", quiet=quiet) as report:
        if from_file:
            transport = _render_file(scene, projector, camera, samples, seed or 0, report)
        else:
            from nearfar.scenes.cache import cached_scene

            transport = cached_scene(scene, projector, camera, progress=report)
        save_exact(transport, output, force=force)
    say(
        f"transport of {scene}, projector {transport.projector}, camera {transport.camera}, "
        f"written to {output}",
        quiet=quiet,
    )


def _render_file(
    scene: str,
    projector: Size | None,
    camera: Size | None,
    samples: int | None,
    seed: int,
    report: Report,
) -> "ExactTransport":
    from nearfar.scenes.mitsuba.loading import load_scene
    from nearfar.scenes.mitsuba.transport import SAMPLES, render_transport

    loaded = load_scene(scene, projector, camera)
    for note in loaded.notes:
        warn(note)
    return render_transport(loaded, samples or SAMPLES, seed, progress=report)
