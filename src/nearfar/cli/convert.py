"""``nearfar convert``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.options import Force, Quiet, TransportPath, keep_input
from nearfar.cli.saying import say
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
    import numpy as np

    from nearfar.files import check_output, new_output
    from nearfar.transport.store import load_transport

    if output.suffix.lower() != ".npy":
        raise InputError(f"{output} does not end in .npy: choose a name that does.")
    keep_input(output, transport)
    check_output(output, force=force)
    with progress_bar("converting", quiet=quiet):
        opened = load_transport(transport)
        if correspondence:
            array, what = opened.correspondence, "correspondence"
        else:
            array, what = np.moveaxis(opened.dense(), 1, 2), "dense transport"
            array = array[..., 0] if opened.channels == 1 else array
        array = np.ascontiguousarray(array)
        with new_output(output, force=force) as partial, partial.open("wb") as file:
            header = np.lib.format.header_data_from_array_1_0(array)
            np.lib.format.write_array_header_1_0(file, header)
            # numpy's own writing does not tell a full disk from other faults.
            file.write(array.data)
    shape = " x ".join(map(str, array.shape))
    say(f"{what}, {shape} {array.dtype}, written to {output}", quiet=quiet)
