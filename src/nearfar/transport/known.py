"""Transports that are known exactly: as matrices, or as operators where these are too large."""

from pathlib import Path

from nearfar.arrays import AnyPath, AnySize
from nearfar.files import kind_of_store
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_operator import ExactOperator
from nearfar.transport.exact_store import load_exact, save_exact
from nearfar.transport.operator_store import KIND as OPERATOR_KIND
from nearfar.transport.operator_store import load_operator, save_operator

KnownTransport = ExactTransport | ExactOperator


def load_known(
    path: AnyPath, *, projector: AnySize | None = None, camera: AnySize | None = None
) -> KnownTransport:
    """Read what ``nearfar render`` wrote, or a dense T.

    Parameters
    ----------
    path, projector, camera
        As `load_exact`.

    Raises
    ------
    MissingFileError, UnreadableFileError, InputError
        As `load_exact`.
    """
    if kind_of_store(Path(path)) == OPERATOR_KIND:
        return load_operator(path)
    return load_exact(path, projector=projector, camera=camera)


def save_known(transport: KnownTransport, path: AnyPath, *, force: bool = False) -> None:
    """Write a transport that is known exactly; raises as `save_exact`."""
    if isinstance(transport, ExactOperator):
        save_operator(transport, path, force=force)
    else:
        save_exact(transport, path, force=force)
