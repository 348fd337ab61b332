"""The report of an evaluation: relit pictures beside known ones, and signal-to-noise ratios."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np

from nearfar.decibels import EXACT, ROUNDING, in_words
from nearfar.markup import numbers
from nearfar.report.beside import pictures_beside
from nearfar.report.figures.style import new_figure, styled
from nearfar.report.methods import evaluation_methods
from nearfar.report.page import colour_map, facts, listed, page, plot
from nearfar.report.splits import splits_section
from nearfar.report.transport_page import exposure_of, kept_verdict_box
from nearfar.transport.model import Transport
from nearfar.workflow.evaluate import Rows
from nearfar.workflow.judge import Pair, describe_units, white_last

# How to read the maps.
ROWS_READING = (
    "Dark: the light of single projector pixels is wrong there, although pictures may relight well."
)
FREQUENCIES_READING = (
    "How well stripes of each frequency relight: coarse ones in the middle, fine ones outside. "
    "Measured frequencies may stand out as dots; the darker, the worse."
)


def evaluation_page(
    transport: Transport,
    source: str,
    judgement: Mapping[str, Any],
    pairs: Mapping[str, Pair],
    rows: Rows | None = None,
    faults: Sequence[str] = (),
    *,
    command: str | None = None,
) -> str:
    """Return the report of an evaluation as one self-contained HTML page.

    Parameters
    ----------
    transport : Transport
        If a verdict is kept with it, the page begins with that.
    source : str
        Name of what it was compared with.
    judgement : mapping
        As `nearfar.workflow.judge` returns it.
    pairs : mapping of str to Pair
        Relit and known picture under each light, by the light's name.
    rows : Rows, optional
        SNR of each row; given if the true transport is known.
    faults : sequence of str
        Faults of the pictures that were compared, a sentence each.
    command : str, optional
        As `nearfar.report.page.page` takes it.
    """
    snr_b: Mapping[str, float] = judgement["snr_b"]
    ceiling = judgement.get("ceiling", {}).get("snr_b", {})
    if "snr_b_pictures" in judgement:
        cards = [(in_words(judgement["snr_b_pictures"]), "SNR_b, mean of natural pictures")]
    else:
        cards = [(in_words(judgement["snr_b_mean"]), f"SNR_b, mean of {len(snr_b)} lights")]
    if rows is not None:
        cards.append((in_words(judgement["snr_t"]["p50"]), "SNR_t, median camera pixel"))
        cards.append(
            (in_words(judgement["snr_t"]["p5"]), "SNR_t that 95 of 100 camera pixels exceed")
        )
    head = ["light", "SNR_b", *(["ceiling of the model, no noise"] if ceiling else [])]
    table = [
        [name, in_words(value), *([in_words(ceiling[name])] if ceiling else [])]
        for name, value in white_last(snr_b).items()
    ]
    exposure = exposure_of(transport)
    white_says = ""
    if "white" in snr_b:
        white_says = " White was photographed itself, so that it is no measure of relighting."
    verdict = transport.verdict
    body = f"""
<h1>How close the transport comes</h1>
{"" if verdict is None else kept_verdict_box(verdict)}
<p>Compared with {escape(source)}. SNR_b is 20 log10 of the known picture over the difference,
SNR_t the same of a camera pixel's row of the transport.</p>
{facts(cards)}
{_remarks(judgement, faults)}
<h2>Relit beside what is known</h2>
{pictures_beside(white_last(pairs), exposure, "known")}
<h2>Figures</h2>
<p>20 dB are an error of 10 %, 40 dB of 1 %, 60 dB of 0.1 %.{white_says}</p>
{numbers(head, table)}
{splits_section(judgement)}
{_row_section(rows, transport)}
"""
    methods = evaluation_methods(transport.provenance, len(snr_b), by_truth=rows is not None)
    return page("nearfar: evaluation", body, methods=methods, command=command)


def _remarks(judgement: Mapping[str, Any], faults: Sequence[str]) -> str:
    units = [f"{text[0].upper()}{text[1:]}." for text in describe_units(judgement)]
    sentences = [*faults, *units]
    return listed(sentences) if sentences else ""


def _row_section(rows: Rows | None, transport: Transport) -> str:
    if rows is None:
        return ""
    saturated = None if transport.quality is None else transport.quality.saturated
    snr_t = rows.snr_t if saturated is None else np.where(saturated, np.nan, rows.snr_t)
    title = "<h2>Every camera pixel, every frequency</h2>"
    known = np.concatenate([snr_t.ravel(), rows.snr_b_of_frequency.ravel()])
    known = known[np.isfinite(known)]
    if known.size and known.min() > ROUNDING:
        return f"{title}<p>All rows and all frequencies are {EXACT}.</p>"
    with styled():
        figure = new_figure(2.2)
        axes = figure.subplots()
        # Beyond it there is noise of the arithmetic alone.
        axes.hist(np.minimum(snr_t[np.isfinite(snr_t)], ROUNDING), bins=60, color="#1f4e9c")
        axes.set(xlabel="SNR_t, dB", ylabel="camera pixels")
    reading = (
        "The further to the right, the better. A second hump at the left is of camera pixels "
        "that the model does not hold, or that see little light; the maps show where they are."
    )
    if (snr_t > ROUNDING).any():
        reading += f" Rows at {ROUNDING:.0f} dB are {EXACT}."
    maps = (
        (snr_t, saturated, "SNR_t of every camera pixel", ROWS_READING),
        (
            rows.snr_b_of_frequency,
            None,
            "SNR_b under every frequency, DC in the middle",
            FREQUENCIES_READING,
        ),
    )
    drawn = ""
    # A sample of rows makes no map.
    for values, marked, caption, how in maps[rows.compared < rows.snr_t.size :]:
        shown = np.minimum(values, ROUNDING)
        finite = shown[np.isfinite(shown)]
        low, high = map(float, np.percentile(finite, [1, 99]) if finite.size else (0.0, 1.0))
        drawn += colour_map(shown, low, high, "dB", caption, reading=how, saturated=marked)
    return f'{title}{plot(figure, "histogram of SNR_t", reading)}<div class="maps">{drawn}</div>'
