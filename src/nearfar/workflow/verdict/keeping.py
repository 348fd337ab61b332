"""Judge a stored transport, and keep the verdict with it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nearfar.arrays import AnyPath
from nearfar.capture import Capture
from nearfar.checks import require_instance
from nearfar.errors import InputError, KeptInterrupt, NearfarError
from nearfar.files.kinds import METADATA
from nearfar.files.output import require_writable, storage_faults
from nearfar.progress import Report, ignore_progress
from nearfar.transport.gains import why_unjudgeable
from nearfar.transport.parts import USUAL_PARTS
from nearfar.transport.store_writing import write_verdict
from nearfar.transport.stored import StoredTransport, open_transport
from nearfar.workflow.reconstruction.summary import LARGEST_OF_TILES, description_of
from nearfar.workflow.verdict.verdict import Verdict, judge_reconstruction

# Entries of the provenance without which a transport cannot be judged.
PROVENANCE = ("method", "square", "drift", *LARGEST_OF_TILES)


def judge_transport(path: AnyPath, capture: Capture, *, progress: Report | None = None) -> Verdict:
    """Judge a transport by the photos that its estimate never saw, and keep the verdict with it.

    ``nearfar reconstruct`` and ``nearfar acquire --transport`` do so as their last step. A verdict
    that the transport has already is replaced.

    Parameters
    ----------
    path : str or Path
        The transport, in a file.
    capture : Capture
        What it was reconstructed from.
    progress : callable, optional
        Called with the step and the share of it that is done, 0 to 1.

    Returns
    -------
    Verdict
        What is kept of it is the ``verdict`` of the transport from now on: of what
        `nearfar.load_transport` returns.

    Raises
    ------
    InputError
        If the transport was reconstructed from another capture, was multiplied by gains since, or
        does not say how it was made.
    MissingFileError, UnreadableFileError
        If the transport or the capture is not there, or damaged.
    StorageError
        If the verdict cannot be written.
    KeptInterrupt
        If it was interrupted. As with every fault met while judging, the transport stays as it
        is, and the message says so.

    Examples
    --------
    >>> done = nearfar.reconstruct_to_file(capture, "judged.zarr")
    >>> nearfar.judge_transport("judged.zarr", capture).grade
    'good'
    >>> nearfar.load_transport("judged.zarr").verdict.checked_by  # its stripes are light as well
    'half-screens and wide bars'
    """
    require_instance(capture, Capture, "capture", "nearfar.open_capture")
    path = Path(path)
    stored = open_transport(path)
    require_origin(stored, capture)
    require_writable(path, path / METADATA)
    unjudged = f"{path} stays as it is, and was not judged"
    try:
        verdict = judge_reconstruction(stored, capture, progress or ignore_progress)
        with storage_faults(path):
            write_verdict(path, verdict.kept)
    except KeyboardInterrupt as error:
        raise KeptInterrupt(f"interrupted; {unjudged}.") from error
    except NearfarError as error:
        raise type(error)(f"{str(error).removesuffix('.')}; {unjudged}.") from error
    return verdict


def require_origin(stored: StoredTransport, capture: Capture) -> None:
    """Refuse a capture that a transport was not reconstructed from.

    Raises
    ------
    InputError
        As `judge_transport`.
    """
    if any(name not in stored.provenance for name in PROVENANCE):
        raise InputError(
            f"{stored.path} does not say how it was made, so that it cannot be judged: reconstruct "
            f"the capture again."
        )
    if why := why_unjudgeable(stored.provenance):
        raise InputError(f"{stored.path} {why}")
    if capture.plan.offset == "shown" or stored.parts != USUAL_PARTS:
        of = "somebody else's patterns" if stored.parts == USUAL_PARTS else "lamps"
        raise InputError(
            f"{stored.path} is of {of}, and was judged by held-out photos when it was "
            f"reconstructed: its verdict is kept with it, so give the transport without a capture."
        )
    of_transport: dict[str, Any] = {
        "projector": stored.projector,
        "channels": stored.channels,
        **{name: stored.provenance.get(name) for name in ("plan", "photos", "rig")},
    }
    of_capture = {
        "projector": capture.plan.projector,
        "channels": capture.channels,
        **description_of(capture),
    }
    if not stored.provenance["square"]:
        of_transport["camera"], of_capture["camera"] = stored.camera, capture.camera
    other = [name for name in of_transport if _differ(of_transport[name], of_capture[name])]
    if other:
        raise InputError(
            f"{stored.path} was not reconstructed from {capture.path}, or before photos were taken "
            f"again, for its {', '.join(other)} are others: give the capture as it was."
        )


def _differ(kept: Any, found: Any) -> bool:
    """Return whether entries of both differ; older transports keep fewer of their capture."""
    if isinstance(kept, Mapping) and isinstance(found, Mapping):
        return any(kept[name] != found[name] for name in kept.keys() & found.keys())
    return kept is not None and kept != found
