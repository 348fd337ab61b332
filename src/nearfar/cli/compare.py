"""``nearfar compare``."""

import json
from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from nearfar.cli.options import (
    AsJson,
    Force,
    Quiet,
    ScenesCamera,
    ScenesProjector,
    scene_names,
)
from nearfar.cli.saying import say
from nearfar.progress import progress_bar
from nearfar.scenes import SCENES
from nearfar.workflow.rivals import RIVALS


def method_names(start: str) -> list[str]:
    """Return the methods whose names start with `start`, for shells to complete."""
    return [name for name in RIVALS if name.startswith(start)]


def compare(
    scene: Annotated[
        str,
        typer.Argument(
            metavar="SCENE",
            autocompletion=scene_names,
            help=f"Scene ({', '.join(SCENES)}), or a transport that render wrote.",
        ),
    ],
    output: Annotated[Path | None, typer.Argument(metavar="[OUT]", help="Folder to make.")] = None,
    photos: Annotated[
        str | None,
        typer.Option(
            help="Numbers of photos to compare at; by default from a sixteenth of the paper's to "
            "all of them.",
            metavar="N,N,...",
        ),
    ] = None,
    method: Annotated[
        list[str] | None,
        typer.Option(
            help=f"{', '.join(map(quote, RIVALS))}; all by default; may be repeated.",
            autocompletion=method_names,
            metavar="NAME",
        ),
    ] = None,
    projector: ScenesProjector = None,
    camera: ScenesCamera = None,
    near: Annotated[
        int | None, typer.Option(min=1, metavar="W", help="W of the joint estimate's plans.")
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run methods side by side on a simulated scene, at equal photos and at equal total exposure.

    Example: nearfar compare cornell comparison --projector 32x32
    """
    from nearfar.files import check_output
    from nearfar.report.comparison import INDEX, is_comparison, winners, write_comparison
    from nearfar.scenes.cache import cached_scene
    from nearfar.transport.exact_store import load_exact
    from nearfar.workflow.compare import compare as run
    from nearfar.workflow.compare import known_methods

    if output is not None:
        check_output(output, force=force, replaceable=is_comparison)
    budgets, methods = _budgets(photos), known_methods(method)
    with progress_bar("comparing", quiet=quiet or as_json) as report:
        if scene in SCENES:
            truth = cached_scene(scene, projector, camera, progress=report)
        else:
            truth = load_exact(Path(scene), projector=projector, camera=camera)
        found = run(truth, budgets, methods=methods, window=near, progress=report)
        if output is not None:
            write_comparison(output, found, force=force)
    if as_json:
        print(json.dumps(found.numbers(), allow_nan=False))
        return
    say("SNR_b under pictures at equal photos", quiet=quiet)
    say("\n".join(f"  {line}" for line in winners(found.equal_photos)), quiet=quiet)
    say("at equal total exposure, counted in photos", quiet=quiet)
    say("\n".join(f"  {line}" for line in winners(found.equal_exposure)), quiet=quiet)
    if output is not None:
        say(f"open {output / INDEX}", quiet=quiet)


def _budgets(text: str | None) -> list[int] | None:
    if text is None:
        return None
    try:
        return [int(part) for part in text.split(",")]
    except ValueError:
        raise typer.BadParameter(
            f"{text!r} is no list of budgets: write numbers with commas, such as 50,100,200.",
            param_hint="--photos",
        ) from None
