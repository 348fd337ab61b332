"""What commands open: a reconstructed transport, with a warning if it was judged wrong; a rig."""

from pathlib import Path
from typing import TYPE_CHECKING

from nearfar.cli.options import require_reconstructed
from nearfar.cli.saying import warn_if_wrong

if TYPE_CHECKING:
    from nearfar.transport.model import Transport
    from nearfar.transport.stored import StoredTransport


def open_reconstructed(path: Path) -> "StoredTransport":
    """Open a transport, to be read some rows of the camera at a time.

    Raises
    ------
    UnreadableFileError
        If it is no transport, or is yet to be reconstructed.
    """
    from nearfar.transport.stored import open_transport

    require_reconstructed(path)
    opened = open_transport(path)
    warn_if_wrong(path, opened.verdict)
    return opened


def load_reconstructed(path: Path) -> "Transport":
    """Load a transport whole.

    Raises
    ------
    UnreadableFileError
        As `open_reconstructed`.
    """
    from nearfar.transport.store import load_transport

    require_reconstructed(path)
    loaded = load_transport(path)
    warn_if_wrong(path, loaded.verdict)
    return loaded


def check_rig(rig: str) -> None:
    """Check, before any work, that a rig is there and its RIG.toml can be read.

    Raises
    ------
    InputError, MissingFileError, UnreadableFileError
    """
    from nearfar.rigs.opening import require_rig
    from nearfar.rigs.tables import read_rig_table

    require_rig(rig)
    if Path(rig).suffix.lower() == ".toml":
        read_rig_table(Path(rig))
