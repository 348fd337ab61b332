"""Steps of ``nearfar separate``: photos from a rig or a folder, and comparison."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from nearfar.arrays import Size
from nearfar.cli.saying import say, warn
from nearfar.progress import Report, counting, progress_bar

if TYPE_CHECKING:
    from nearfar.baselines.separation import Separation
    from nearfar.baselines.separation_methods import Method
    from nearfar.baselines.separation_photos import PhotosToSeparate


def export_patterns(
    output: Path,
    method: "Method",
    projector: Size | None,
    scale: int | None,
    native: Size | None,
    *,
    force: bool,
    quiet: bool,
) -> None:
    """Write the patterns of a method, and print what was written."""
    from nearfar.workflow.separate import export_to_separate

    if projector is None:
        raise typer.BadParameter("--export needs the pattern grid.", param_hint="--projector")
    count = (method.count or 0) + 1
    with progress_bar("patterns", quiet=quiet) as report:
        layout = export_to_separate(
            output,
            method,
            projector,
            scale=scale,
            native=native,
            force=force,
            progress=counting(report, "patterns", count),
        )
    say(
        f"{count} patterns of {layout.frame}, the last one black, written to {output}, a pattern "
        f"pixel as {layout.scale} x {layout.scale}",
        quiet=quiet,
    )


def read_photos(
    photos: Path,
    method: "Method",
    ambient: Path | None,
    black: Path | None,
    black_level: float | None,
    full_scale: float | None,
    report: Report,
) -> "PhotosToSeparate":
    """Read the user's own photos."""
    from nearfar.baselines.separation_photos import read_to_separate

    return read_to_separate(
        photos,
        method.count,
        ambient=ambient,
        black=black,
        black_level=black_level,
        full_scale=full_scale,
        progress=lambda done, total: report("photos", done / total),
    )


def shoot_photos(
    rig: str, projector: Size | None, method: "Method", report: Report
) -> "tuple[PhotosToSeparate, dict[str, Any]]":
    """Shoot a method's patterns; return the photos and the rig's description."""
    from nearfar.baselines.separation_photos import shoot_to_separate
    from nearfar.rigs.opening import open_rig

    if projector is None:
        projector = _projector_of(rig)
    assert method.draw is not None
    # Patterns that do not fit are refused before a scene is computed.
    patterns = method.draw(projector)
    with open_rig(rig, projector, progress=report, on_alarm=warn) as opened:
        for note in opened.notes:
            warn(note)
        progress = counting(report, "photos", len(patterns) + 1)
        return shoot_to_separate(opened, patterns, progress=progress), opened.describe()


def _projector_of(rig: str) -> Size:
    """Return the pattern grid of a scene, or of a stored transport that knows it."""
    from nearfar.rigs.simulated.opening import load_world
    from nearfar.scenes import SCENES, sizes

    if rig in SCENES:
        return sizes(rig)[0]
    path = Path(rig)
    if path.suffix.lower() in {".toml", ".xml"} or not path.exists():
        raise typer.BadParameter(f"--rig {rig} needs the pattern grid.", param_hint="--projector")
    return load_world(path, None, None).projector


class Compared(NamedTuple):
    """SNR of direct and global against each of what they were compared with, dB, and faults."""

    snr: dict[str, dict[str, float]]
    faults: list[str]


def compare(
    found: "Separation",
    truth: Path | None,
    transport: Path | None,
    exposure: float | None,
    projector: Size | None,
) -> Compared:
    """Compare direct and global with a truth, a reconstruction, or both."""
    from nearfar.transport.exact_store import load_exact
    from nearfar.transport.store import load_transport
    from nearfar.workflow.separate import compare_to_transport, compare_to_truth

    snr, faults = {}, list[str]()
    if truth is not None:
        camera = Size(*found.direct.shape[:2])
        known = load_exact(truth, projector=projector, camera=camera)
        beside = compare_to_truth(found, known, exposure, name=str(truth))
        snr["truth"], faults = beside.snr, beside.faults
    if transport is not None:
        snr["transport"] = compare_to_transport(found, load_transport(transport))
    return Compared(snr, faults)
