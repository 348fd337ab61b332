"""``nearfar superpose``."""

import json
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from nearfar.cli.lights import Resize, Srgb, read_light_for_capture, say_resized
from nearfar.cli.options import AsJson, CapturePath, Force, Quiet, keep_input
from nearfar.cli.saying import say, warn
from nearfar.progress import progress_bar

# As a share of the light's norm: -40 dB. Less is lost among noise and 8-bit patterns.
MOST_MISSING = 0.01


def superpose(
    capture_path: CapturePath,
    light: Annotated[Path, typer.Argument(metavar="LIGHT", help="Light, of the projector's size.")],
    output: Annotated[Path, typer.Argument(metavar="OUT", help=".npy, .exr, .tiff or .png.")],
    srgb: Srgb = False,
    resize: Resize = False,
    error_bars: Annotated[
        bool,
        typer.Option(
            "--error-bars",
            help="Write the picture's standard deviation by the photos' noise instead of the "
            "picture, infinite where the camera is saturated.",
        ),
    ] = False,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Relight by a weighted sum of the photos of a capture alone, without a transport.

    It is exact for lights that are sums of the patterns that were shown, whatever the scene, and
    says how much of the light is not.

    Example: nearfar superpose capture.zarr light.png relit.exr --srgb
    """
    from nearfar.capture import open_capture
    from nearfar.errors import InputError
    from nearfar.files import check_output, check_picture_ending, write_picture
    from nearfar.workflow.superpose import superpose as add_up

    check_picture_ending(output)
    keep_input(output, capture_path, light)
    check_output(output, force=force)
    capture = open_capture(capture_path)
    with progress_bar("superposing", quiet=quiet or as_json) as report:
        projected, given = read_light_for_capture(capture, light, srgb=srgb, resize=resize)
        found = add_up(capture, projected, progress=report)
        if error_bars and found.sigma is None:
            raise InputError(
                f"the photos of {capture_path} do not tell their noise, as no patterns of theirs "
                f"add up to nothing: leave out --error-bars, or shoot patterns with their inverses "
                f"or some twice."
            )
        chosen = found.sigma if error_bars and found.sigma is not None else found.picture
        write_picture(output, chosen, force=force, may_be_infinite=error_bars)
    decibels = found.missing_decibels
    how_much = f"{found.missing:.2g} of its norm, {decibels:.0f} dB"
    if found.missing > MOST_MISSING:
        warn(
            f"{light} is not a sum of the patterns of {capture_path}: a part of it ({how_much}) is "
            f"missing from the picture and from its error bars. Reconstruct a transport and "
            f"relight by it, or shoot patterns of that kind."
        )
    if as_json:
        numbers = {
            "photos": len(capture.plan.patterns),
            "missing_share": found.missing,
            "missing_dB": decibels if np.isfinite(decibels) else None,
            "noise_known": found.sigma is not None,
        }
        print(json.dumps(numbers, allow_nan=False))
        return
    say_resized(light, given, capture.plan.projector, quiet=quiet)
    what = "standard deviation of the picture" if error_bars else "picture"
    say(
        f"{what} of {capture.camera} from {len(capture.plan.patterns)} photos written to {output}; "
        f"the patterns make up the light but for {how_much}",
        quiet=quiet,
    )
