"""Methods side by side on a page: SNR_b against photos and against total exposure, and a table."""

import json
from collections.abc import Sequence
from html import escape
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nearfar.decibels import in_figures, in_words
from nearfar.files import new_output
from nearfar.markup import numbers
from nearfar.report.figures.style import new_figure, save, styled
from nearfar.report.methods import comparison_methods
from nearfar.report.page import figure_caption, listed, page, plot
from nearfar.workflow.comparison import Comparison, Trial
from nearfar.workflow.rivals import RIVALS

INDEX = "index.html"
PLOT = "comparison"
DATA = "comparison.json"
# Also what `is_comparison` recognises the page by.
TITLE = "nearfar: methods compared"
# In dB; with a lower SNR_b a relit picture is hardly recognisable.
MINIMUM_PLOTTED_SNR = 10.0
MINIMUM_TICK_RATIO = 1.25
MOST_LABELS_IN_A_ROW = 5
PLOT_SHOWS = "SNR against photos and exposure"
READING = (
    "Each line is a method; higher is better, and 20 dB are an error of 10 %, 40 dB of 1 %. On the "
    "left every photo is exposed alike; on the right all photos together get the same light, so "
    "that methods of many photos gain nothing by their number. What is below "
    f"{MINIMUM_PLOTTED_SNR:.0f} dB stands in the tables alone."
)
BEST = (
    "The best on pictures of each budget at which several methods were tried is marked, with the "
    "budget."
)


def is_comparison(folder: Path) -> bool:
    """Return whether a folder holds a comparison and nothing else, or nothing at all."""
    entries = list(folder.iterdir())
    ours = {INDEX, DATA, f"{PLOT}.pdf", f"{PLOT}.png"}
    if not all(entry.is_file() and entry.name in ours for entry in entries):
        return False
    return not entries or TITLE in (folder / INDEX).read_text(encoding="utf-8", errors="replace")


def write_comparison(
    output: Path, comparison: Comparison, *, force: bool = False, command: str | None = None
) -> None:
    """Write a folder: ``index.html``, ``comparison.pdf``, ``.png`` and ``.json``.

    Parameters
    ----------
    output : Path
        Folder to create.
    comparison : Comparison
    force : bool
        Whether to replace the folder of an earlier comparison.
    command : str, optional
        As `nearfar.report.page.page` takes it.

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
        (partial / INDEX).write_text(comparison_page(comparison, command), encoding="utf-8")


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
    left.set(xlabel="photos in all, each exposed alike", title="equal photos")
    right.set(xlabel="total exposure, photos' worth", title="equal total exposure")
    left.set_ylabel("SNR$_b$, mean over pictures, dB")
    handles, labels = left.get_legend_handles_labels()
    # In rows of about the same length.
    rows = -(-len(labels) // MOST_LABELS_IN_A_ROW)
    columns = -(-len(labels) // max(rows, 1))
    figure.legend(handles, labels, loc="outside lower center", ncols=columns)
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


def best_of(trials: Sequence[Trial]) -> dict[Trial, list[int]]:
    """Return the trials that relight pictures best, with the budgets at which they do.

    A budget at which one method alone was tried has no best.
    """
    best: dict[Trial, list[int]] = {}
    for budget in sorted({trial.budget for trial in trials}):
        rivals = [trial for trial in trials if trial.budget == budget]
        if len({trial.method for trial in rivals}) > 1:
            best.setdefault(max(rivals, key=lambda trial: trial.pictures), []).append(budget)
    return best


def verdict(comparison: Comparison) -> str:
    """Return in a sentence which method relights pictures best at equal photos, and where."""
    budgets: dict[str, list[int]] = {}
    for trial, mine in best_of(comparison.equal_photos).items():
        budgets.setdefault(trial.method, []).extend(mine)
    if not budgets:
        return "No two methods were tried at one number of photos."
    parts = [
        f"{RIVALS[method].title} at {', '.join(map(str, sorted(mine)))} photos"
        for method, mine in sorted(budgets.items(), key=lambda pair: -len(pair[1]))
    ]
    return f"Best on pictures: {'; '.join(parts)}."


def describe_failures(comparison: Comparison) -> list[str]:
    """Return a sentence for each method that was left out or failed, and one if it was stopped."""
    reasons: dict[tuple[str, str], list[int]] = {}
    for failure in comparison.failures:
        reasons.setdefault((failure.method, failure.reason), []).append(failure.budget)
    said = [
        f"{RIVALS[method].title} is left out: it {reason}."
        for method, reason in comparison.left_out
    ]
    said += [
        f"{RIVALS[method].title} came to nothing at {', '.join(map(str, sorted(set(mine))))}: "
        f"{reason}"
        for (method, reason), mine in reasons.items()
    ]
    if not comparison.is_finished:
        said.append("The comparison was stopped before its end: some trials are missing.")
    return said


def winners(trials: Sequence[Trial]) -> list[str]:
    """Return a line for each budget: the best method, the second best, and their SNR_b."""
    lines = []
    for budget in sorted({trial.budget for trial in trials}):
        rivals = (trial for trial in trials if trial.budget == budget)
        best, *others = sorted(rivals, key=lambda trial: trial.pictures, reverse=True)
        text = f"{budget}: {RIVALS[best.method].title} {in_words(best.pictures)}"
        if others:
            text += f", then {RIVALS[others[0].method].title} {in_words(others[0].pictures)}"
        lines.append(text)
    return lines


def table_rows(trials: Sequence[Trial]) -> list[list[str]]:
    """Return the rows of a table, sorted by method and number of photos."""
    best = best_of(trials)
    return [
        [
            RIVALS[trial.method].title,
            f"{trial.photos}",
            f"{trial.exposure:.0f}",
            *map(in_figures, (trial.pictures, trial.white, trial.random)),
            ", ".join(map(str, best.get(trial, []))),
        ]
        for trial in _ordered(trials)
    ]


def _ordered(trials: Sequence[Trial]) -> list[Trial]:
    methods = list(RIVALS)
    return sorted(trials, key=lambda t: (methods.index(t.method), t.photos, t.exposure))


def assumption_rows(comparison: Comparison) -> list[list[str]]:
    """Return a row for each method that was tried or left out and says what it assumes."""
    trials = (*comparison.equal_photos, *comparison.equal_exposure)
    named = {trial.method for trial in trials} | {method for method, _ in comparison.left_out}
    return [
        [RIVALS[method].title, RIVALS[method].assumes]
        for method in RIVALS
        if method in named and RIVALS[method].assumes
    ]


ASSUMPTIONS_HEAD = ["method", "assumes"]
TABLE_HEAD = ["method", "photos", "exposure", "pictures", "white", "random", "best of"]


def standalone_page(comparison: Comparison, command: str | None = None) -> str:
    """Return the page with the plot inside, which needs no other file."""
    with styled():
        figure = draw(comparison)
    return _page(comparison, plot(figure, PLOT_SHOWS, READING), "", command)


def comparison_page(comparison: Comparison, command: str | None = None) -> str:
    """Return the page beside whose file those of the plot and the data lie."""
    sheet = (
        f'<figure class="sheet"><img src="{PLOT}.png" alt="{PLOT_SHOWS}">'
        f"{figure_caption(PLOT_SHOWS, READING)}</figure>"
    )
    links = f'<a href="{PLOT}.pdf">PDF</a>, <a href="{DATA}">data</a>.'
    return _page(comparison, sheet, links, command)


def _page(comparison: Comparison, sheet: str, links: str, command: str | None) -> str:
    caption = (
        "Every method sees the same scene, camera and noise, and finds correspondence itself where "
        "it needs it; photos count stripes, inverses, references and black, and both photos of a "
        "light with negative parts. The paper's method takes the best of several far bands, "
        "compressive light transport the regularisation that fits the true transport best, and a "
        "method with a threshold the best of several. A method whose patterns depend on its photos "
        "may take fewer photos than it is allowed."
    )
    body = [
        f"<h1>Methods compared on {escape(comparison.scene)}</h1>",
        f'<p class="verdict">{escape(verdict(comparison))}</p>',
        listed(describe_failures(comparison)) if describe_failures(comparison) else "",
        f"<p>Projector {comparison.projector}, camera {comparison.camera}. SNR_b in dB: the mean "
        f"over five pictures with the spectra of photographs, under white, and under a random "
        f"pattern.</p>",
        sheet,
        f"<p>{caption} {links}</p>",
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
        best = best_of(trials)
        marked = [place for place, trial in enumerate(_ordered(trials)) if trial in best]
        table = numbers(TABLE_HEAD, table_rows(trials), marked)
        body += [f"<h2>{title}</h2>", f"<p>{text} {BEST}</p>", table]
    assumptions = assumption_rows(comparison)
    if assumptions:
        table = numbers(ASSUMPTIONS_HEAD, assumptions)
        body += ["<h2>What each method assumes</h2>", f'<div class="words">{table}</div>']
    methods = comparison_methods(comparison)
    return page(TITLE, "\n".join(body), methods=methods, command=command)
