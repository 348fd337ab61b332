"""Old names of the reconstruction, for scripts that use them."""

from typing import Any

from nearfar.arrays import AnyPath
from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.progress import Report
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.reconstruction.summary import Summary


def reconstruct_on(
    scheduler: str,
    capture: Capture,
    output: AnyPath,
    correspondence: Correspondence | None = None,
    *,
    force: bool = False,
    progress: Report | None = None,
    **options: Any,
) -> Summary:
    """Call `nearfar.reconstruct_to_file` with a scheduler, which replaces this function.

    Parameters and errors are those of `nearfar.reconstruct_to_file`; keywords are fields of its
    options.
    """
    return reconstruct_to_file(
        capture,
        output,
        correspondence,
        ReconstructionOptions(**options),
        scheduler=scheduler,
        force=force,
        progress=progress,
    )
