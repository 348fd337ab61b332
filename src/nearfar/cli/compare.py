"""``nearfar compare``."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING, Annotated

import typer

from nearfar.arrays import Size
from nearfar.cli.command_line import command_line
from nearfar.cli.options import (
    AsJson,
    Force,
    Quiet,
    ReportPath,
    ScenesCamera,
    ScenesProjector,
    check_report_page,
    scene_names,
)
from nearfar.cli.saying import say, say_memory, warn
from nearfar.errors import KeptInterrupt
from nearfar.progress import Report, progress_bar
from nearfar.scenes import SCENES
from nearfar.workflow.rivals import RIVALS

if TYPE_CHECKING:
    from nearfar.transport.known import KnownTransport
    from nearfar.workflow.comparison import Comparison


def method_names(start: str) -> list[str]:
    """Return the methods whose names start with `start`, for shells to complete."""
    return [name for name in RIVALS if name.startswith(start)]


def compare(
    scene: Annotated[
        str,
        typer.Argument(
            metavar="SCENE",
            autocompletion=scene_names,
            help=f"Scene ({', '.join(SCENES)}), or a transport: what render wrote, or a dense T of "
            "any origin (.npy, .npz, Zarr).",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Argument(
            metavar="[OUT]", help="Folder to make, for the page, the plot and the data."
        ),
    ] = None,
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
    report: ReportPath = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run methods side by side on a simulated scene, at equal photos and at equal total exposure.

    A method that fails leaves the others their results, and what a comparison that is stopped has
    found is written and printed all the same.

    Example: nearfar compare cornell comparison --projector 32x32
    """
    from nearfar.files import check_output
    from nearfar.report.comparison import is_comparison
    from nearfar.workflow.compare import compare as run
    from nearfar.workflow.compare import describe_work, known_budgets, known_methods

    outputs = _Outputs(output, report, as_json=as_json, force=force, quiet=quiet)
    if output is not None:
        check_output(output, force=force, replaceable=is_comparison)
    if report is not None:
        check_report_page(report, Path(scene), *([output] if output else []), force=force)
    budgets, methods = _budgets(photos), known_methods(method)
    with outputs.kept(), progress_bar("comparing", quiet=quiet or as_json) as told:
        truth = _load(scene, projector, camera, told, quiet=quiet or as_json)
        budgets = known_budgets(truth.projector, budgets)
        say(describe_work(truth, methods, budgets), quiet=quiet or as_json)
        run(
            truth,
            budgets,
            methods=methods,
            window=near,
            progress=told,
            on_trial=outputs.take,
            note=lambda sentence: say(sentence, quiet=quiet or as_json),
        )


class _Outputs:
    """Where a comparison goes: the screen, a folder and a page, whole or as far as it came."""

    def __init__(
        self,
        folder: Path | None,
        page: Path | None,
        *,
        as_json: bool,
        force: bool,
        quiet: bool,
    ) -> None:
        self.folder, self.page = folder, page
        self.as_json, self.force, self.quiet = as_json, force, quiet
        self.found: Comparison | None = None

    def take(self, found: "Comparison") -> None:
        """Take the comparison so far."""
        self.found = found

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Write and print what was found, whatever ends the work."""
        try:
            yield
        except KeyboardInterrupt:
            if self.found is None:
                raise
            self._write(self.found)
            raise KeptInterrupt(f"interrupted; {self._where()}.") from None
        except BaseException:
            # A fault of our own, or of another package's method: it is told of after this.
            if self.found is not None:
                self._write(self.found)
            raise
        if self.found is not None:
            self._write(self.found)

    def _where(self) -> str:
        places = [str(place) for place in (self.folder, self.page) if place is not None]
        if not places:
            return "what was compared until then stands above"
        return f"what was compared until then is in {' and '.join(places)}"

    def _write(self, found: "Comparison") -> None:
        from nearfar.report.comparison import (
            INDEX,
            describe_failures,
            standalone_page,
            verdict,
            winners,
            write_comparison,
        )
        from nearfar.report.page import write_page

        if self.folder is not None:
            write_comparison(self.folder, found, force=self.force, command=command_line())
        if self.page is not None:
            write_page(self.page, standalone_page(found, command_line()), force=self.force)
        for sentence in describe_failures(found):
            warn(sentence)
        if self.as_json:
            print(json.dumps(found.numbers(), allow_nan=False))
            return
        for title, trials in (
            ("SNR_b under pictures at equal photos", found.equal_photos),
            ("at equal total exposure, counted in photos", found.equal_exposure),
        ):
            lines = [title, *(f"  {line}" for line in winners(trials))]
            say("\n".join(lines), quiet=self.quiet)
        say(verdict(found), quiet=self.quiet)
        shown = self.page or (self.folder and self.folder / INDEX)
        if shown is not None:
            say(f"open {shown}", quiet=self.quiet)


def _load(
    scene: str, projector: Size | None, camera: Size | None, report: Report, *, quiet: bool
) -> "KnownTransport":
    """Compute a scene, or load a transport."""
    from nearfar.scenes.cache import cached_known
    from nearfar.transport.exact_store import load_exact

    if scene in SCENES:
        say_memory(scene, projector, camera, quiet=quiet)
        return cached_known(scene, projector, camera, progress=report)
    return load_exact(Path(scene), projector=projector, camera=camera)


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
