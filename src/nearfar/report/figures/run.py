"""Draw the paper's figures: each as PDF and PNG with its data, and a page that shows them all."""

from collections.abc import Callable
from html import escape
from pathlib import Path

from nearfar.callbacks import Report
from nearfar.errors import InputError
from nearfar.files import new_output
from nearfar.markup import numbers
from nearfar.report.figures import NAMES
from nearfar.report.figures.sheets import SHEETS
from nearfar.report.figures.style import save, styled
from nearfar.report.figures.table import relighting_table, table
from nearfar.report.methods import figures_methods
from nearfar.report.model_check import HEAD, check_rows
from nearfar.report.page import page
from nearfar.workflow.experiments.data import Data, kept, together, write_data
from nearfar.workflow.experiments.paper import EXPERIMENTS

INDEX = "index.html"
# Also what `is_figures` recognises the page by.
TITLE = "nearfar: figures of the paper"
# Figures whose data the table needs.
TABLE_FIGURES = ("2", "4", "5", "3", "6")


def is_figures(folder: Path) -> bool:
    """Return whether a folder holds figures and nothing else, or nothing at all."""
    entries = list(folder.iterdir())
    ours = {f"figure-{name}{ending}" for name in SHEETS for ending in (".pdf", ".png", ".npz")}
    if not all(entry.is_file() and entry.name in {INDEX, *ours} for entry in entries):
        return False
    # A lone index.html may be anyone's.
    return not entries or TITLE in (folder / INDEX).read_text(encoding="utf-8", errors="replace")


def check_names(names: list[str]) -> list[str]:
    """Return the requested figures in order, or all if none is requested.

    Raises
    ------
    InputError
        If there is no such figure.
    """
    for name in names:
        if name not in NAMES:
            raise InputError(
                f"there is no figure {name!r}: choose from {', '.join(NAMES[:-1])} or {NAMES[-1]}."
            )
    return [name for name in NAMES if not names or name in names]


def make_figures(
    output: Path,
    only: list[str] | None = None,
    *,
    force: bool = False,
    progress: Report | None = None,
    note: Callable[[str], None] | None = None,
    command: str | None = None,
) -> dict[str, Data]:
    """Draw figures into a folder.

    Parameters
    ----------
    output : Path
        Folder to create: ``figure-1.pdf``, ``.png`` and ``.npz`` and so on, and ``index.html``.
    only : list of str, optional
        Names of `nearfar.report.figures.NAMES`; all by default.
    force : bool
        Whether to replace an existing folder of figures.
    progress : callable, optional
        Called with the name of a step and the share of it that is done.
    note : callable, optional
        Called with a sentence on why saved data are computed again.
    command : str, optional
        As `nearfar.report.page.page` takes it.

    Returns
    -------
    dict
        The data of each figure that was drawn, or that the table is made of.

    Raises
    ------
    InputError
        If there is no such figure.
    NearfarError
        As `nearfar.files.new_output`.
    """
    chosen = check_names(only or [])
    report = progress or (lambda _what, _share: None)
    say = note or (lambda _text: None)
    drawn = [name for name in chosen if name in SHEETS]
    needed = drawn + [name for name in TABLE_FIGURES if "table" in chosen and name not in drawn]
    with new_output(output, force=force, replaceable=is_figures) as partial:
        partial.mkdir()
        experiments = [one for name in sorted(needed) for one in SHEETS[name].experiments]
        # Each experiment is saved as soon as it is done, so that an interrupt loses little.
        measured = {one: _measured(one, report, say) for one in dict.fromkeys(experiments)}
        found = {
            name: together([measured[one] for one in SHEETS[name].experiments]) for name in needed
        }
        for number, name in enumerate(drawn):
            _draw(partial, name, found[name])
            report("drawing", (number + 1) / len(drawn))
        text = index_page(drawn, found, with_table="table" in chosen, command=command)
        (partial / INDEX).write_text(text, encoding="utf-8")
    return found


def _measured(experiment: str, report: Report, note: Callable[[str], None]) -> Data:
    def report_step(step: str, share: float) -> None:
        report(f"{experiment}: {step}", share)

    return kept(experiment, lambda: EXPERIMENTS[experiment](report_step), note=note)


def _draw(folder: Path, name: str, data: Data) -> None:
    sheet = SHEETS[name]
    with styled():
        figure = sheet.draw(data)
    save(figure, folder, f"figure-{name}")
    write_data(folder / f"figure-{name}.npz", f"figure {name}", sheet.data_of(data))


def index_page(
    drawn: list[str], found: dict[str, Data], *, with_table: bool, command: str | None = None
) -> str:
    """Return the page that shows the figures and the tables."""
    body = [
        "<h1>The paper's figures, from data made here</h1>",
        "<p>After Reddy, Ramamoorthi and Curless, <i>Frequency-Space Decomposition and Acquisition "
        "of Light Transport under Spatially Varying Illumination</i>, ECCV 2012. The scenes are "
        "simulated and their transport is known exactly.</p>",
    ]
    for name in drawn:
        sheet, file = SHEETS[name], f"figure-{name}"
        caption = escape(sheet.caption(found[name]))
        body.append(
            f'<h2 id="{file}">Figure {name}. {escape(sheet.title)}</h2>\n<figure class="sheet">'
            f'<img src="{file}.png" alt="{escape(sheet.title)}. {caption}">'
            f'<figcaption>{caption} <a href="{file}.pdf">PDF</a>, '
            f'<a href="{file}.npz">data</a>.</figcaption></figure>'
        )
    if with_table:
        body += _tables(found)
    return page(TITLE, "\n".join(body), methods=figures_methods(), command=command)


def _tables(found: dict[str, Data]) -> list[str]:
    patterns = found["6"].numbers["CLT"]["patterns"]
    return [
        '<h2 id="table">What the paper states, and what was measured</h2>',
        "<p>Lowest and mean over all DFT frequencies of the pattern grid (SNR_b) and over all "
        "camera pixels (SNR_t). The paper's box and corner are real scenes, whose truth nobody "
        "knows; its text prints no SNR for them.</p>",
        f'<div class="broad">{table(found)}</div>',
        "<h2>Beside compressive light transport</h2>",
        f"<p>Under figure 6's lights and over all camera pixels, {patterns} patterns each.</p>",
        relighting_table(found["6"]),
        "<h2>Where the model holds</h2>",
        "<p>What the method assumes, and what was measured on the box of figures 2 and 3.</p>",
        numbers(list(HEAD), check_rows(found["3"].numbers["check"])),
    ]
