"""Methods side by side on a page: SNR_b against photos and against total exposure, and a table."""

import json
from collections.abc import Sequence
from html import escape
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nearfar.files import new_output
from nearfar.markup import numbers
from nearfar.report.figures.style import new_figure, save, styled
from nearfar.report.page import page
from nearfar.workflow.compare import Comparison, Trial
from nearfar.workflow.rivals import RIVALS

INDEX = "index.html"
PLOT = "comparison"
DATA = "comparison.json"
# The title, by which a page of a comparison is told from others.
MARK = "nearfar: methods compared"
# What lies below is no picture any more.
LOWEST = 10.0
# Ticks closer than this factor are one.
CLOSE = 1.25


def is_comparison(folder: Path) -> bool:
    """Tell whether a folder is a comparison and nothing else, or holds nothing at all."""
    entries = list(folder.iterdir())
    ours = {INDEX, DATA, f"{PLOT}.pdf", f"{PLOT}.png"}
    if not all(entry.is_file() and entry.name in ours for entry in entries):
        return False
    return not entries or MARK in (folder / INDEX).read_text(encoding="utf-8", errors="replace")


def write_comparison(output: Path, found: Comparison, *, force: bool = False) -> None:
    """Write a folder: ``index.html``, ``comparison.pdf``, ``.png`` and ``.json``.

    Raises
    ------
    NearfarError
        As `nearfar.files.new_output`.
    """
    with new_output(output, force=force, replaceable=is_comparison) as partial:
        partial.mkdir()
        with styled():
            figure = draw(found)
        save(figure, partial, PLOT)
        text = json.dumps(found.numbers(), indent=1, allow_nan=False)
        (partial / DATA).write_text(text, encoding="utf-8")
        (partial / INDEX).write_text(comparison_page(found), encoding="utf-8")


def draw(found: Comparison) -> Figure:
    """Draw SNR_b under pictures against photos and against total exposure."""
    figure = new_figure(3.2)
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, trials in (
        (left, found.equal_photos),
        (right, found.equal_exposure),
    ):
        _draw_lines(axes, trials)
    # Both share the axis, so it is cut when all is drawn.
    left.set_ylim(bottom=max(LOWEST, left.get_ylim()[0]))
    left.set_xlabel("photos in all, each exposed alike")
    right.set_xlabel("total exposure, photos' worth")
    left.set_ylabel("SNR$_b$, mean over pictures, dB")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def _draw_lines(axes: Axes, trials: Sequence[Trial]) -> None:
    for method in RIVALS:
        # Where each photo is exposed alike, the total exposure is their number.
        mine = sorted((t.exposure, t.pictures) for t in trials if t.method == method)
        if mine:
            places, values = zip(*mine, strict=True)
            rival = RIVALS[method]
            axes.plot(places, values, label=rival.title, markersize=3.5, **rival.line)
    axes.set_xscale("log")
    axes.set_xticks(_apart(sorted({trial.budget for trial in trials})))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.tick_params(axis="x", rotation=45)
    axes.grid(linewidth=0.3, color="#cccccc")


def _apart(places: Sequence[int]) -> list[int]:
    """Leave out ticks that would be written over each other."""
    kept: list[int] = []
    for place in places:
        if not kept or place > CLOSE * kept[-1]:
            kept.append(place)
    return kept


def winners(trials: Sequence[Trial]) -> list[str]:
    """Say for each budget which method came out best, and by how much."""
    lines = []
    for budget in sorted({trial.budget for trial in trials}):
        mine = (trial for trial in trials if trial.budget == budget)
        best, *others = sorted(mine, key=lambda trial: trial.pictures, reverse=True)
        text = f"{budget}: {RIVALS[best.method].title} {best.pictures:.1f} dB"
        if others:
            text += f", then {RIVALS[others[0].method].title} {others[0].pictures:.1f} dB"
        lines.append(text)
    return lines


def rows(trials: Sequence[Trial]) -> list[list[str]]:
    """Return rows of a table, in the order of methods and photos."""
    methods = list(RIVALS)
    order = sorted(trials, key=lambda t: (methods.index(t.method), t.photos, t.exposure))
    return [
        [
            RIVALS[trial.method].title,
            f"{trial.photos}",
            f"{trial.exposure:.0f}",
            *(f"{value:.1f}" for value in (trial.pictures, trial.white, trial.random)),
        ]
        for trial in order
    ]


HEAD = ["method", "photos", "exposure", "pictures", "white", "random"]


def comparison_page(found: Comparison) -> str:
    """Return the page with the plot and the tables."""
    caption = (
        "Every method sees the same scene, camera and noise, and finds correspondence itself where "
        "it needs it; photos count stripes, inverses, references and black. The paper's method "
        "takes the best of several far bands, compressive light transport the regularisation that "
        "the true transport likes best."
    )
    body = [
        f"<h1>Methods compared on {escape(found.scene)}</h1>",
        f"<p>Projector {found.projector}, camera {found.camera}. SNR_b in dB: the mean over five "
        f"pictures with the spectra of photographs, under white, and under a random pattern.</p>",
        f'<figure class="sheet"><img src="{PLOT}.png" alt="SNR against photos and exposure">'
        f'<figcaption>{caption} <a href="{PLOT}.pdf">PDF</a>, <a href="{DATA}">data</a>.'
        f"</figcaption></figure>",
    ]
    for title, text, trials in (
        ("Equal photos", "Each photo is exposed alike.", found.equal_photos),
        (
            "Equal total exposure",
            "Exposure in photos' worth: a method of many photos exposes each for less, one of few "
            "for longer, its well as much deeper.",
            found.equal_exposure,
        ),
    ):
        body += [f"<h2>{title}</h2>", f"<p>{text}</p>", numbers(HEAD, rows(trials))]
    return page(MARK, "\n".join(body))
