"""``nearfar bounces``."""

from pathlib import Path
from typing import Annotated

import typer

from nearfar.cli.lights import Resize, Srgb, light_or_white, require_light, say_resized
from nearfar.cli.opening import open_reconstructed
from nearfar.cli.options import Force, Quiet, TransportPath, keep_input
from nearfar.cli.saying import say, warn
from nearfar.progress import progress_bar


def bounces(
    transport: TransportPath,
    output: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to make.")],
    light: Annotated[
        Path | None,
        typer.Option(help="Light, of the projector's size; white if left out.", metavar="LIGHT"),
    ] = None,
    count: Annotated[
        int, typer.Option("--n", min=1, help="Bounces to tell apart.", metavar="N")
    ] = 4,
    srgb: Srgb = False,
    resize: Resize = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Take a relit picture apart by how often its light was reflected (Seitz et al. 2005).

    DIR gets bounce-1, bounce-2 ... and later, the rest, as .npy, in photo units, and .png for
    looking, brightened; together they are the relit picture. The first bounce is direct light and
    light under surfaces. DIR/numbers.json has the shares of the light.

    Example: nearfar bounces transport.zarr bounces --light light.png --srgb --n 3
    """
    from nearfar.files import check_output
    from nearfar.workflow.bounces import (
        bounces_of_stored,
        describe_bounces,
        is_bounces,
        summarise_bounces,
        write_bounces,
    )

    require_light(light, srgb=srgb, resize=resize)
    keep_input(output, transport, *([light] if light else []))
    check_output(output, force=force, replaceable=is_bounces)
    with progress_bar("bounces", quiet=quiet) as report:
        opened = open_reconstructed(transport)
        projected, given = light_or_white(opened, light, srgb=srgb, resize=resize)
        found = bounces_of_stored(opened, projected, count, progress=report)
        numbers = describe_bounces(found)
        write_bounces(output, found, numbers, force=force)
    for fault in found.faults:
        warn(fault)
    if light is not None:
        say_resized(light, given, opened.projector, quiet=quiet)
    say(f"{summarise_bounces(numbers)}\nwritten to {output}", quiet=quiet)
