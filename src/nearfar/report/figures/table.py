"""The table of what the paper states and what was measured."""

from collections.abc import Mapping
from typing import Any

from nearfar.decibels import in_words
from nearfar.markup import numbers
from nearfar.report.figures.rival import LIGHTS
from nearfar.workflow.experiments.data import Data

HEAD = (
    "",
    "photos of transport",
    "savings in theory (equation 13)",
    "savings",
    "SNR_b over frequencies: lowest",
    "mean",
    "SNR_t over camera pixels: lowest",
    "mean",
    "reconstruction",
)


# The paper's values, column by column; empty where it prints none.
PAPER_VALUES = {
    "2": ("1060", "about 31", "15.4", "", "", "", "", ""),
    "4": ("788", "", "20.8", "", "", "", "", ""),
    "5": ("423", "", "", "25 dB or more", "", "25 dB or more", "", ""),
}
NAMES = {
    "2": "figure 2: box with a candle, noisy photos",
    "4": "figure 4: corner, noisy photos",
    "5": "figure 5: wedge with a toy, by theory",
}


def rows(found: Mapping[str, Data]) -> list[list[str]]:
    """Return the rows of the table: each experiment, and below it what the paper states."""
    lines: list[list[str]] = []
    for figure in (name for name in PAPER_VALUES if name in found):
        data = found[figure]
        lines.append([NAMES[figure], *_measured(data.numbers)])
        lines.append(
            ["as the paper states", *(stated or "not stated" for stated in PAPER_VALUES[figure])]
        )
    return lines


def _measured(found: Mapping[str, Any]) -> list[str]:
    plan = found["plan"]
    photos = str(plan["transport_photos"])
    if stripes := plan["photos"]["correspondence"]:
        photos += f" + {stripes} stripes"
    return [
        photos,
        f"{found['savings_in_theory']:.2f}",
        f"{plan['savings']:.2f}",
        in_words(found["snr_b_frequency"]["p0"]),
        in_words(found["snr_b_frequency"]["mean"]),
        in_words(found["snr_t"]["p0"]),
        in_words(found["snr_t"]["mean"]),
        f"{found['seconds']['reconstruction']:.1f} s",
    ]


def relighting_table(found: Data) -> str:
    """Return the SNR of this method and of CLT in figure 6 as HTML; the better one is bold."""
    values = _relighting(found)
    rows = [
        [name, in_words(one), in_words(other), f"{one - other:+.1f} dB"]
        for name, one, other in values
    ]
    best = {(row, 1 if one > other else 2) for row, (_, one, other) in enumerate(values)}
    return numbers(["", "this method", "CLT", "difference"], rows, best=best)


def _relighting(found: Data) -> list[tuple[str, float, float]]:
    """Return the SNR of this method and of CLT under each of figure 6's lights, and of rows."""
    ours, theirs = found.numbers, found.numbers["CLT"]
    pairs = [
        (f"SNR_b, {LIGHTS[light]}", value, theirs["snr_b"][light])
        for light, value in ours["snr_b"].items()
    ]
    pairs += [
        (f"SNR_t, {name}", ours["snr_t"][key], theirs["snr_t"][key])
        for name, key in (("mean", "mean"), ("lowest", "p0"))
    ]
    return pairs


def table(found: Mapping[str, Data]) -> str:
    """Return the main table as HTML."""
    return numbers(list(HEAD), rows(found))
