"""``nearfar compensate``."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.cli.compensate_together import Wanted, compensate_projectors
from nearfar.cli.lights import read_camera_picture
from nearfar.cli.opening import open_reconstructed
from nearfar.cli.options import (
    AsJson,
    Force,
    Quiet,
    TransportPath,
    keep_apart,
    keep_input,
    scene_names,
)
from nearfar.cli.other_projectors import OtherProjector, others_of
from nearfar.cli.refining import MOST, check_refinement, check_simulated_rig, refined
from nearfar.cli.saying import say
from nearfar.errors import InputError
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.arrays import Floats
    from nearfar.transport.model import Transport


def _scale(text: str) -> float | None:
    """Return the scale; None for one that is to be chosen."""
    if text == "auto":
        return None
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(
            f"{text!r} is no scale: write auto or a number.", param_hint="--scale"
        ) from None


def _black_of(transport: "Transport", path: Path) -> "Floats":
    """Return the photo under black.

    Raises
    ------
    InputError
        If it holds light of other projectors, whose photos were shared.
    """
    if "shared_photos" in transport.provenance.get("rig", {}):
        raise InputError(
            f"{path} is of photos that several projectors share, so that its photo under black "
            f"holds half of the others' white: leave out --as-photo, and give WANTED without "
            f"ambient light."
        )
    return transport.black


def compensate(
    transport: TransportPath,
    wanted: Annotated[
        Path,
        typer.Argument(metavar="WANTED", help="What the photo is to look like; camera's size."),
    ],
    output: Annotated[
        Path,
        typer.Argument(
            metavar="LIGHT_OUT", help="Light to project, linear: .npy, .exr, .tiff or .png."
        ),
    ],
    scale: Annotated[
        str,
        typer.Option(
            metavar="auto|S",
            help="What WANTED is multiplied by; auto: so that 95 % of the camera pixels need no "
            "more than full white.",
        ),
    ] = "auto",
    expected: Annotated[
        Path | None,
        typer.Option(metavar="OUT", help="Write what the photo is expected to be, too."),
    ] = None,
    out_of_reach: Annotated[
        Path | None,
        typer.Option(
            metavar="OUT", help="Write a map of camera pixels that no light serves, 1 there."
        ),
    ] = None,
    as_photo: Annotated[
        bool,
        typer.Option(
            "--as-photo",
            help="WANTED is a photo as the camera is to take it, ambient light and black level "
            "included: those of the capture's photo under black.",
        ),
    ] = False,
    refine: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=MOST,
            metavar="N",
            help="Correct the light N times by photos of it, 1 to 3; a photo more confirms it.",
        ),
    ] = None,
    rig: Annotated[
        str | None,
        typer.Option(
            metavar="RIG",
            help="For --refine: RIG.toml, scene or stored transport, as for acquire.",
            autocompletion=scene_names,
        ),
    ] = None,
    other: Annotated[
        list[str] | None,
        typer.Option(
            "--and",
            help="Transport of a further projector before the same camera, and where to write its "
            "light.",
            metavar="TRANSPORT.zarr=LIGHT_OUT",
        ),
    ] = None,
    srgb: Annotated[
        bool, typer.Option("--srgb", help="WANTED is an ordinary sRGB picture.")
    ] = False,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Find the light under which the scene looks like a picture: radiometric compensation.

    Texture, shading and light from other surfaces are counter-acted. WANTED is linear light without
    ambient light, as relit pictures are, unless --as-photo is given.

    Example: nearfar compensate transport.zarr wanted.png light.png --srgb
    """
    import numpy as np

    from nearfar.applications.compensate import compensate as found_by
    from nearfar.applications.compensate import describe, summarise
    from nearfar.files import check_output, check_picture_ending, write_light, write_picture
    from nearfar.workflow.refine import describe_photos, summarise_photos

    given = _scale(scale)
    check_refinement(refine, rig)
    if others := others_of(other, "RIGHT.zarr=RIGHT_LIGHT_OUT"):
        if as_photo or refine is not None:
            raise typer.BadParameter(
                "is for one projector with --refine or --as-photo: leave these out, or leave it "
                "out.",
                param_hint="--and",
            )
        compensate_projectors(
            [OtherProjector(transport, output), *others],
            Wanted(wanted, given, srgb, expected, out_of_reach),
            as_json=as_json,
            force=force,
            quiet=quiet,
        )
        return
    outputs = [output, *filter(None, (expected, out_of_reach))]
    keep_apart(outputs)
    for path in outputs:
        check_picture_ending(path)
        keep_input(path, transport, wanted, *([Path(rig)] if rig else []))
        check_output(path, force=force)
    with progress_bar("compensation", quiet=quiet) as report:
        opened = open_reconstructed(transport)
        picture = read_camera_picture(wanted, opened.camera, opened.channels, srgb=srgb)
        if rig is not None:
            check_simulated_rig(rig, opened)
        rows = opened.rows()
        black = _black_of(rows, transport) if as_photo else None
        found = found_by(rows, picture, given, black=black, progress=report)
        if refine is None:
            write_light(output, found.light, force=force)
    numbers, words = describe(found), summarise(found)
    if refine is not None and rig is not None:
        if not as_json:
            say(words, quiet=quiet)
        better = refined(rows, found, rig, refine, output=output, force=force, quiet=quiet)
        numbers, words = numbers | describe_photos(better), summarise_photos(better)
    # After the light, so that nothing is left of a command whose rig does not fit.
    if expected is not None:
        write_picture(expected, found.expected, force=force)
    if out_of_reach is not None:
        write_picture(out_of_reach, found.out_of_reach.astype(np.float32), force=force)
    if as_json:
        print(json.dumps(numbers, allow_nan=False))
    else:
        say(f"{words}\nlight of {opened.projector} written to {output}", quiet=quiet)
