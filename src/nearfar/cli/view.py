"""``nearfar view``."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import parse_bytes
from nearfar.cli.flat_fields import CameraFlat, ProjectorFlat, read_flat
from nearfar.cli.options import Browser, Port, Quiet, TransportPath, require_reconstructed
from nearfar.cli.saying import say
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.applications.flat_fields import FlatFields
    from nearfar.progress import Report
    from nearfar.report.maps import Map
    from nearfar.transport.stored import StoredTransport
    from nearfar.viewer.beside import Beside
    from nearfar.viewer.interactive import InteractiveTransport
    from nearfar.viewer.photo_series import PhotoSeries


def view(
    transport: TransportPath,
    other: Annotated[
        list[Path] | None,
        typer.Option(
            "--and",
            help="Transport of a further projector before the same camera, with a light of its "
            "own; one per --and.",
            metavar="TRANSPORT.zarr",
        ),
    ] = None,
    beside: Annotated[
        Path | None,
        typer.Option(
            help="Second transport to show under the same light: another reconstruction, what "
            "render wrote, or a dense T (.npy, .npz, Zarr), of the same projector and camera.",
            metavar="SECOND.zarr",
        ),
    ] = None,
    capture: Annotated[
        Path | None,
        typer.Option(
            help="Photos that it was reconstructed from: shows where it is off at those that no "
            "estimate used, and compares the scene with each of them.",
            metavar="CAPTURE.zarr",
        ),
    ] = None,
    camera_flat: CameraFlat = None,
    projector_flat: ProjectorFlat = None,
    port: Port = 8628,
    host: Annotated[
        str,
        typer.Option(
            help="Address to serve at; beyond this machine the page asks for a token.",
            metavar="ADDRESS",
        ),
    ] = "127.0.0.1",
    memory: Annotated[
        str,
        typer.Option(
            help="Memory for each transport; a larger one is read again whenever the light comes "
            "to rest.",
            metavar="2GB",
        ),
    ] = "2GB",
    browser: Browser = True,
    quiet: Quiet = False,
) -> None:
    """Relight the scene in the browser: drag a light, and see its direct, near and far parts.

    With --beside a second transport is shown next to it, with their signed difference and SNR. With
    --and further projectors light the scene, and the page shows the sum. --projector-flat is of the
    first projector.

    Example: nearfar view transport.zarr --beside truth.zarr
    """
    import webbrowser

    from nearfar.applications.several_projectors import require_same_camera
    from nearfar.transport.stored import open_transport
    from nearfar.viewer.beside import open_beside
    from nearfar.viewer.interactive import InteractiveTransport
    from nearfar.viewer.server import ListeningAddress
    from nearfar.viewer.view import run_view

    available = parse_bytes(memory)
    paths = [transport, *(other or ())]
    for path in paths:
        require_reconstructed(path)
    stored = [open_transport(path) for path in paths]
    require_same_camera(stored, list(map(str, paths)))
    flat_fields = _flat_fields_of(stored, camera_flat, projector_flat)
    second: Beside | None = None
    maps: Mapping[str, Map] = {}
    series: PhotoSeries | None = None
    with progress_bar("reading", quiet=quiet) as report:
        interactive = InteractiveTransport(
            transport, memory=available, progress=lambda share: report("reading", share)
        )
        others = [
            InteractiveTransport(one, memory=available, progress=partial(report, f"reading {one}"))
            for one in paths[1:]
        ]
        for each, flats in zip((interactive, *others), flat_fields, strict=True):
            each.flat_fields = flats
        if beside is not None:
            second = open_beside(
                beside,
                interactive,
                memory=available,
                progress=lambda share: report(f"reading {beside}", share),
            )
        if capture is not None:
            maps, series = _photos_of(interactive, capture, report)

    _tell_of_memory(max(each.nbytes for each in stored), available, quiet=quiet)

    def on_start(url: str) -> None:
        say(f"{transport} at {url}, Ctrl-C here ends it")
        if browser:
            webbrowser.open(url)

    # Ctrl-C is how it ends.
    with suppress(KeyboardInterrupt):
        listening = ListeningAddress(host, port)
        run_view(
            interactive,
            listening,
            on_start,
            beside=second,
            photo_maps=maps,
            photo_series=series,
            others=others,
        )
    say("view ended", quiet=quiet)


def _flat_fields_of(
    stored: Sequence["StoredTransport"], camera_flat: Path | None, projector_flat: Path | None
) -> "list[FlatFields]":
    """Read flat fields: the camera's for all transports, the projector's for the first."""
    from nearfar.applications.flat_fields import flat_fields

    of_camera = read_flat(camera_flat, stored[0].camera)
    of_projector = read_flat(projector_flat, stored[0].projector)
    return [
        flat_fields(
            of_camera,
            None if number else of_projector,
            each.camera,
            each.projector,
            each.channels,
        )
        for number, each in enumerate(stored)
    ]


def _photos_of(
    transport: "InteractiveTransport", path: Path, report: "Report"
) -> tuple[Mapping[str, "Map"], "PhotoSeries"]:
    """Read what a page has of the capture that a transport was reconstructed from."""
    from nearfar.capture import open_capture
    from nearfar.viewer.held_out import photo_maps
    from nearfar.viewer.photo_series import PhotoSeries

    capture = open_capture(path)
    return photo_maps(transport.stored, capture, report), PhotoSeries(transport, capture)


def _tell_of_memory(needed: int, available: int, *, quiet: bool) -> None:
    """Say how a transport that is larger than the memory for it is kept there."""
    if needed > available:
        say(
            f"the transport takes {needed / 1e9:.1f} GB and is read again whenever the light comes "
            f"to rest: --memory {math.ceil(needed / 1e9)}GB keeps it in memory",
            quiet=quiet,
        )
