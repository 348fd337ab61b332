"""``nearfar convert``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.options import Force, Quiet, TransportPath, keep_input
from nearfar.cli.saying import say, warn_if_wrong
from nearfar.errors import InputError
from nearfar.progress import progress_bar


def convert(
    transport: TransportPath,
    output: Annotated[Path, typer.Argument(metavar="OUT.npy", help="Array to write.")],
    correspondence: Annotated[
        bool,
        typer.Option("--correspondence", help="Write q, H x W x 2, instead of the dense T."),
    ] = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Write a transport as a dense array T, (C, P) or (C, P, channels), or its correspondence.

    Example: nearfar convert transport.zarr T.npy
    """
    from nearfar.files import check_output, write_array
    from nearfar.transport.store import load_transport
    from nearfar.workflow.convert import dense_array

    if output.suffix.lower() != ".npy":
        raise InputError(f"{output} does not end in .npy: choose a name that does.")
    keep_input(output, transport)
    check_output(output, force=force)
    with progress_bar("converting", quiet=quiet):
        opened = load_transport(transport)
        warn_if_wrong(transport, opened.verdict)
        array = opened.correspondence if correspondence else dense_array(opened)
        write_array(output, array, force=force)
    what = "correspondence" if correspondence else "dense transport"
    shape = " x ".join(map(str, array.shape))
    say(f"{what}, {shape} {array.dtype}, written to {output}", quiet=quiet)
