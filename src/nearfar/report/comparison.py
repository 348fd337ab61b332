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
# Also what `is_comparison` recognises the page by.
TITLE = "nearfar: methods compared"
# In dB; with a lower SNR_b a relit picture is hardly recognisable.
MINIMUM_PLOTTED_SNR = 10.0
MINIMUM_TICK_RATIO = 1.25


def is_comparison(folder: Path) -> bool:
    """Return whether a folder holds a comparison and nothing else, or nothing at all."""
    entries = list(folder.iterdir())
    ours = {INDEX, DATA, f"{PLOT}.pdf", f"{PLOT}.png"}
    if not all(entry.is_file() and entry.name in ours for entry in entries):
        return False
    return not entries or TITLE in (folder / INDEX).read_text(encoding="utf-8", errors="replace")


def write_comparison(output: Path, comparison: Comparison, *, force: bool = False) -> None:
    """Write a folder: ``index.html``, ``comparison.pdf``, ``.png`` and ``.json``.

    Raises
    ------
    NearfarError
        As `nearfar.files.new_output`.
    """
    with new_output(output, force=force, replaceable=is_comparison) as partial:
        partial.mkdir()
        with styled():
            figure = draw(comparison)
        save(figure, partial, PLOT)
        text = json.dumps(comparison.numbers(), indent=1, allow_nan=False)
        (partial / DATA).write_text(text, encoding="utf-8")
        (partial / INDEX).write_text(comparison_page(comparison), encoding="utf-8")


def draw(comparison: Comparison) -> Figure:
    """Draw SNR_b under pictures against photos and against total exposure."""
    figure = new_figure(3.2)
    left, right = figure.subplots(1, 2, sharey=True)
    for axes, trials in (
        (left, comparison.equal_photos),
        (right, comparison.equal_exposure),
    ):
        _draw_lines(axes, trials)
    # After both plots, which share the axis, have set its limits.
    left.set_ylim(bottom=max(MINIMUM_PLOTTED_SNR, left.get_ylim()[0]))
    left.set_xlabel("photos in all, each exposed alike")
    right.set_xlabel("total exposure, photos' worth")
    left.set_ylabel("SNR$_b$, mean over pictures, dB")
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels))
    return figure


def _draw_lines(axes: Axes, trials: Sequence[Trial]) -> None:
    for method in RIVALS:
        # With equal photos, the total exposure is the number of photos.
        points = sorted((t.exposure, t.pictures) for t in trials if t.method == method)
        if points:
            exposures, values = zip(*points, strict=True)
            rival = RIVALS[method]
            axes.plot(exposures, values, label=rival.title, markersize=3.5, **rival.line)
    axes.set_xscale("log")
    axes.set_xticks(_distinct_ticks(sorted({trial.budget for trial in trials})))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.minorticks_off()
    axes.tick_params(axis="x", rotation=45)
    axes.grid(linewidth=0.3, color="#cccccc")


def _distinct_ticks(positions: Sequence[int]) -> list[int]:
    """Leave out ticks whose labels would overlap."""
    kept: list[int] = []
    for position in positions:
        if not kept or position > MINIMUM_TICK_RATIO * kept[-1]:
            kept.append(position)
    return kept


def winners(trials: Sequence[Trial]) -> list[str]:
    """Return a line for each budget: the best method, the second best, and their SNR_b."""
    lines = []
    for budget in sorted({trial.budget for trial in trials}):
        rivals = (trial for trial in trials if trial.budget == budget)
        best, *others = sorted(rivals, key=lambda trial: trial.pictures, reverse=True)
        text = f"{budget}: {RIVALS[best.method].title} {best.pictures:.1f} dB"
        if others:
            text += f", then {RIVALS[others[0].method].title} {others[0].pictures:.1f} dB"
        lines.append(text)
    return lines


def table_rows(trials: Sequence[Trial]) -> list[list[str]]:
    """Return the rows of a table, sorted by method and number of photos."""
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


TABLE_HEAD = ["method", "photos", "exposure", "pictures", "white", "random"]


def comparison_page(comparison: Comparison) -> str:
    """Return the page with the plot and the tables."""
    caption = (
        "Every method sees the same scene, camera and noise, and finds correspondence itself where "
        "it needs it; photos count stripes, inverses, references and black. The paper's method "
        "takes the best of several far bands, compressive light transport the regularisation that "
        "fits the true transport best."
    )
    body = [
        f"<h1>Methods compared on {escape(comparison.scene)}</h1>",
        f"<p>Projector {comparison.projector}, camera {comparison.camera}. SNR_b in dB: the mean "
        f"over five pictures with the spectra of photographs, under white, and under a random "
        f"pattern.</p>",
        f'<figure class="sheet"><img src="{PLOT}.png" alt="SNR against photos and exposure">'
        f'<figcaption>{caption} <a href="{PLOT}.pdf">PDF</a>, <a href="{DATA}">data</a>.'
        f"</figcaption></figure>",
    ]
    for title, text, trials in (
        ("Equal photos", "Each photo is exposed alike.", comparison.equal_photos),
        (
            "Equal total exposure",
            "Exposure is counted in photos: a method with many photos exposes each for less time, "
            "one with few for longer, with a full well that is deeper in proportion.",
            comparison.equal_exposure,
        ),
    ):
        body += [f"<h2>{title}</h2>", f"<p>{text}</p>", numbers(TABLE_HEAD, table_rows(trials))]
    return page(TITLE, "\n".join(body))
