"""``nearfar probe``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.cli.lights import Resize, Srgb, light_or_white, require_light, say_resized
from nearfar.cli.looks import Channel, Exposure, Gamma, look_for
from nearfar.cli.opening import open_reconstructed
from nearfar.cli.options import Force, Quiet, TransportPath, keep_input
from nearfar.cli.saying import say
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.applications.masks import ProbingMask


def _number(text: str, flag: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise typer.BadParameter(f"{text!r} is no number.", param_hint=flag) from None


def _mask(
    within: float | None,
    ring: str | None,
    beyond: float | None,
    epipolar: str | None,
    matrix: Path | None,
) -> "tuple[ProbingMask, list[Path]]":
    """Return the mask that was asked for, and the files it comes from."""
    from nearfar.applications.masks import ProbingMask
    from nearfar.files.arrays import map_array, read_arrays

    given = [value for value in (within, ring, beyond, epipolar, matrix) if value is not None]
    if len(given) != 1:
        raise typer.BadParameter(
            f"{len(given) or 'no'} masks were given: give exactly one of --within, --ring, "
            f"--beyond, --epipolar and --mask."
        )
    if within is not None:
        return ProbingMask.within(within), []
    if beyond is not None:
        return ProbingMask.beyond(beyond), []
    if ring is not None:
        inner, colon, outer = ring.partition(":")
        if not colon:
            raise typer.BadParameter(f"{ring!r} is no ring: write R1:R2.", param_hint="--ring")
        return ProbingMask.ring(_number(inner, "--ring"), _number(outer, "--ring")), []
    if epipolar is not None:
        name, colon, width = epipolar.rpartition(":")
        if not colon:
            raise typer.BadParameter(
                f"{epipolar!r} has no width: write F.npy:WIDTH.", param_hint="--epipolar"
            )
        fundamental = read_arrays(Path(name)).get("array", ())
        return ProbingMask.epipolar(fundamental, _number(width, "--epipolar")), [Path(name)]
    assert matrix is not None
    return ProbingMask.of_matrix(map_array(matrix)), [matrix]


def probe(
    transport: TransportPath,
    output: Annotated[Path, typer.Argument(metavar="OUT", help=".npy, .exr, .tiff or .png.")],
    light: Annotated[
        Path | None,
        typer.Option(metavar="LIGHT", help="Light, of the projector's size; white if left out."),
    ] = None,
    within: Annotated[
        float | None,
        typer.Option(metavar="R", help="Light from less than R projector pixels from q."),
    ] = None,
    ring: Annotated[
        str | None,
        typer.Option(metavar="R1:R2", help="Light from at least R1 and less than R2 from q."),
    ] = None,
    beyond: Annotated[
        float | None,
        typer.Option(metavar="R", help="Light from R projector pixels or more from q."),
    ] = None,
    epipolar: Annotated[
        str | None,
        typer.Option(
            metavar="F.npy:WIDTH",
            help="Light from a band of WIDTH projector pixels about the epipolar line F (x, y, 1) "
            "of camera pixel (x, y).",
        ),
    ] = None,
    mask: Annotated[
        Path | None,
        typer.Option(
            metavar="M.npy",
            help="Weights of the projector's pixels, or of camera pixels by projector pixels.",
        ),
    ] = None,
    srgb: Srgb = False,
    resize: Resize = False,
    exposure: Exposure = 0.0,
    gamma: Gamma = 1.0,
    channel: Channel = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Relight the scene by chosen projector pixels: those near q, far from it, or on a line.

    Without q, as where the projector's light does not fall, all light is from beyond any distance.

    Example: nearfar probe transport.zarr indirect.exr --beyond 5
    """
    from nearfar.applications.probe import probe_stored
    from nearfar.files import check_output, check_picture_ending, write_picture

    require_light(light, srgb=srgb, resize=resize)
    chosen, files = _mask(within, ring, beyond, epipolar, mask)
    check_picture_ending(output)
    look = look_for(output, exposure, gamma, channel)
    keep_input(output, transport, *files, *([light] if light else []))
    check_output(output, force=force)
    with progress_bar("probing", quiet=quiet):
        opened = open_reconstructed(transport)
        projected, given = light_or_white(opened, light, srgb=srgb, resize=resize)
        picture = probe_stored(opened, projected, chosen)
        write_picture(output, look.of(picture), force=force)
    if light is not None:
        say_resized(light, given, opened.projector, quiet=quiet)
    say(f"probed picture of {opened.camera} written to {output}", quiet=quiet)
