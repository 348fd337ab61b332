"""Further projectors of a command: a transport and a file for each, by --and."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer

from nearfar.cli.opening import open_reconstructed

if TYPE_CHECKING:
    from nearfar.transport.stored import StoredTransport


class OtherProjector(NamedTuple):
    """A further projector: its file, and the one that goes with it."""

    path: Path
    beside: Path


def others_of(texts: Sequence[str] | None, what: str) -> list[OtherProjector]:
    """Read further projectors written FILE=BESIDE; others are wrong usage.

    Parameters
    ----------
    texts : sequence of str, or None
    what : str
        How they are to be written.
    """
    found = []
    for text in texts or ():
        path, _, beside = text.partition("=")
        if not path or not beside:
            raise typer.BadParameter(
                f"{text!r} names no further projector: write {what}, one per --and.",
                param_hint="--and",
            )
        found.append(OtherProjector(Path(path), Path(beside)))
    return found


def open_transports(paths: Sequence[Path]) -> "list[StoredTransport]":
    """Open the transports of projectors before one camera, and warn of what is wrong with one.

    Raises
    ------
    InputError
        If their pictures cannot be added.
    UnreadableFileError
        If one is no transport.
    """
    from nearfar.applications.several_projectors import require_same_camera

    opened = [open_reconstructed(path) for path in paths]
    require_same_camera(opened, [str(path) for path in paths])
    return opened
