"""Transports in files: factors in chunks of camera rows."""

from nearfar.arrays import AnyPath
from nearfar.checks import require_instance
from nearfar.deprecation import path_after_content
from nearfar.transport.model import Transport
from nearfar.transport.store_writing import write_transport
from nearfar.transport.stored import open_transport


@path_after_content
def save_transport(transport: Transport, path: AnyPath, *, force: bool = False) -> None:
    """Write a transport as a Zarr group, whole or not at all.

    Parameters
    ----------
    transport : Transport
    path : str or Path
        Folder to make, ending in ``.zarr`` by custom.
    force : bool
        Replace a transport that is there.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.

    Examples
    --------
    >>> nearfar.save_transport(transport, "transport.zarr")
    """
    require_instance(transport, Transport, "transport", "nearfar.reconstruct")
    write_transport(path, [transport], transport.camera.height, force=force)


def load_transport(path: AnyPath) -> Transport:
    """Read all of a transport.

    Parameters
    ----------
    path : str or Path
        What `save_transport` or ``nearfar reconstruct`` wrote.

    Returns
    -------
    Transport

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there, damaged, of another kind or of another version.

    Examples
    --------
    >>> nearfar.save_transport(transport, "kept.zarr")
    >>> kept = nearfar.load_transport("kept.zarr")
    >>> bool(np.allclose(kept @ light, relit))
    True
    """
    return open_transport(path).rows()
