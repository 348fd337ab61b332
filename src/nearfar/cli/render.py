"""``nearfar render``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.options import (
    Force,
    Quiet,
    ScenesCamera,
    ScenesProjector,
    keep_input,
    scene_names,
)
from nearfar.cli.saying import say, say_memory, warn
from nearfar.progress import Report, progress_bar
from nearfar.scenes import SCENES

if TYPE_CHECKING:
    from nearfar.transport.known import KnownTransport


def render(
    scene: Annotated[
        str,
        typer.Argument(
            metavar="SCENE",
            autocompletion=scene_names,
            help=f"Scene ({', '.join(SCENES)}), or a Mitsuba 3 scene (.xml).",
        ),
    ],
    output: Annotated[Path, typer.Argument(metavar="OUT", help="Zarr to make.")],
    projector: ScenesProjector = None,
    camera: ScenesCamera = None,
    samples: Annotated[
        int | None,
        typer.Option(
            metavar="N", min=1, help="Paths per camera pixel of a Mitsuba scene; 4096 if left out."
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(metavar="N", min=0, help="Seed of those paths; 0 if left out."),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Compute a scene's transport: exactly, or by path tracing for a Mitsuba scene.

    The components of a built-in scene are kept apart; a Mitsuba scene's are not known. Where the
    matrices of a built-in scene would be too large, an operator is written instead.

    Example: nearfar render cornell truth.zarr --projector 64x64
    """
    from nearfar.files import check_output
    from nearfar.rigs.opening import is_mitsuba
    from nearfar.transport.exact_store import save_exact

    if scene not in SCENES:
        keep_input(output, Path(scene))
    check_output(output, force=force)
    from_file = is_mitsuba(Path(scene))
    if not from_file and (samples, seed) != (None, None):
        raise typer.BadParameter(
            "a built-in scene is computed without chance: leave it out.",
            param_hint="--samples" if samples is not None else "--seed",
        )
    say_memory(scene, projector, camera, quiet=quiet)
    with progress_bar("rendering", quiet=quiet) as report:
        if from_file:
            transport = _render_file(scene, projector, camera, samples, seed or 0, report)
        else:
            from nearfar.scenes.cache import cached_known

            transport = cached_known(scene, projector, camera, progress=report)
        save_exact(transport, output, force=force)
    say(
        f"transport of {scene}, projector {transport.projector}, camera {transport.camera}, "
        f"written to {output}",
        quiet=quiet,
    )


def _render_file(
    scene: str,
    projector: Size | None,
    camera: Size | None,
    samples: int | None,
    seed: int,
    report: Report,
) -> "KnownTransport":
    from nearfar.scenes.mitsuba.loading import load_scene
    from nearfar.scenes.mitsuba.transport import DEFAULT_SAMPLES, render_transport

    loaded = load_scene(scene, projector, camera)
    for note in loaded.notes:
        warn(note)
    return render_transport(loaded, samples or DEFAULT_SAMPLES, seed, progress=report)
