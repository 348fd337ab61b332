"""``nearfar evaluate``, ``nearfar render`` and ``nearfar info``."""

import json
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from nearfar.arrays import Size
from nearfar.capture import KIND as CAPTURE_KIND
from nearfar.capture import open_capture
from nearfar.cli.options import AsJson, Force, Quiet, TransportPath, size
from nearfar.cli.planning import describe_plan
from nearfar.cli.progress import progress_bar, say
from nearfar.errors import MissingFileError, UnreadableFileError
from nearfar.files import check_output, kind_of_store, read_picture
from nearfar.plan import read_plan
from nearfar.scenes import NAMES
from nearfar.transport.exact_store import KIND as EXACT_KIND
from nearfar.transport.exact_store import load_exact, save_exact
from nearfar.transport.store import KIND as TRANSPORT_KIND
from nearfar.transport.store import load_transport
from nearfar.workflow.judge import judge_by_photos, judge_by_truth


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
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Measure a transport: SNR_b of relighting, SNR_t of rows, its components.

    Example: nearfar evaluate transport.zarr --truth truth.zarr --json
    """
    if (truth is None) == (photos is None):
        raise typer.BadParameter("give either --truth or --photos.", param_hint="--truth")
    opened = load_transport(transport)
    with progress_bar(quiet=quiet) as report:
        if truth is not None:
            known = load_exact(truth, projector=opened.projector, camera=opened.camera)
            found = judge_by_truth(opened, known, progress=report)
        else:
            assert photos is not None
            found = judge_by_photos(opened, photos, full_scale=full_scale)
    if as_json:
        print(json.dumps(found))
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
    scene: Annotated[str, typer.Argument(metavar="SCENE", help=f"One of {', '.join(NAMES)}.")],
    output: Annotated[Path, typer.Argument(metavar="OUT", help="Zarr to make.")],
    projector: Annotated[
        Size | None,
        typer.Option(parser=size, metavar="HxW", help="Pattern grid; the scene's own if left out."),
    ] = None,
    camera: Annotated[
        Size | None,
        typer.Option(parser=size, metavar="HxW", help="Photo; the scene's own if left out."),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Compute the exact transport of a built-in scene, components apart.

    Example: nearfar render cornell truth.zarr --projector 64x64
    """
    from nearfar.scenes.cache import cached_scene

    check_output(output, force=force)
    with progress_bar(quiet=quiet) as report:
        transport = cached_scene(scene, projector, camera, progress=report)
    save_exact(output, transport, force=force)
    say(
        f"transport of {scene}, projector {transport.projector}, camera {transport.camera}, "
        f"written to {output}",
        quiet=quiet,
    )


def info(
    path: Annotated[
        Path, typer.Argument(metavar="FILE", help="Plan, capture, transport, picture.")
    ],
) -> None:
    """Say what a file holds.

    Example: nearfar info capture.zarr
    """
    if not path.exists():
        raise MissingFileError(f"{path} is not there: check the name.")
    if path.is_dir():
        print(_describe_store(path))
    elif path.suffix.lower() == ".json":
        print("nearfar plan\n" + describe_plan(read_plan(path)))
    else:
        pixels = read_picture(path)
        shape = " x ".join(map(str, pixels.shape))
        print(f"picture, {shape} {pixels.dtype}, values {pixels.min():g} to {pixels.max():g}")


def _describe_store(path: Path) -> str:
    kind = kind_of_store(path)
    if kind == CAPTURE_KIND:
        capture = open_capture(path)
        return "\n".join(
            [
                f"{kind}: photos of {capture.camera}, {capture.channels} channels, "
                f"{capture.photos.dtype}, full scale {capture.full_scale:g}, "
                f"{capture.saturated_share:.3%} saturated",
                describe_plan(capture.plan),
                f"rig: {json.dumps(capture.rig)}",
            ]
        )
    if kind == TRANSPORT_KIND:
        transport = load_transport(path)
        floodlit = transport.components(np.ones(transport.projector, dtype=np.float32))
        total = sum(float(part.sum()) for part in floodlit)
        shares = ", ".join(
            f"{name} {float(part.sum()) / total:.1%}"
            for name, part in zip(floodlit._fields, floodlit, strict=True)
        )
        return "\n".join(
            [
                f"{kind}: projector {transport.projector}, camera {transport.camera}, "
                f"{transport.channels} channels, W = {transport.window}, "
                f"{transport.far_basis.count} far coefficients",
                f"{transport.lit.mean():.1%} of the camera pixels directly lit",
                f"floodlit: {shares}",
                f"provenance: {json.dumps(dict(transport.provenance))}",
            ]
        )
    if kind == EXACT_KIND:
        exact = load_exact(path)
        return (
            f"{kind}: {exact.name}, projector {exact.projector}, camera {exact.camera}, "
            f"{exact.channels} channels, components {'apart' if exact.is_apart else 'together'}"
        )
    raise UnreadableFileError(
        f"{path} is nothing that nearfar wrote: name a plan, a capture, a transport or a picture."
    )
