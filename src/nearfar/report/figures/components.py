"""Figures 2 and 4: a scene taken apart, relit under white and under a picture."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from nearfar.report.figures.style import new_figure, note, row_name, show_picture
from nearfar.workflow.experiments.data import Data

PARTS = {
    "light": "light",
    "direct": "direct",
    "near": "near-range",
    "far": "far-range",
    "sum": "sum: relit",
    "exact": "exact",
}
# Near- and far-range light is dim: shown brighter, and said so.
DIM = ("near", "far")
BRIGHTER = 2.0


def draw(data: Data, picture: str) -> Figure:
    """Draw figure 2 or 4 from an acquired scene's data; `picture` is what the light shows."""
    figure = new_figure(2.85)
    draw_parts(figure, data, PARTS, picture, BRIGHTER)
    return figure


def draw_parts(
    figure: Any, data: Data, parts: Mapping[str, str], picture: str, brighter: float
) -> None:
    """Draw parts of what is relit, with their titles, under white and under the picture.

    Parameters
    ----------
    figure : Figure or SubFigure
    data : Data
        With ``white/PART`` and ``picture/PART``; ``sum`` and ``exact`` come last among the parts.
    parts : mapping
        Title of each part.
    picture : str
        What the light shows.
    brighter : float
        How much brighter near- and far-range light is shown.
    """
    rows = {"white": "floodlight", "picture": picture}
    grid = figure.subplots(len(rows), len(parts))
    for axes, (row, label) in zip(grid, rows.items(), strict=True):
        for one, (part, title) in zip(axes, parts.items(), strict=True):
            gain = brighter if part in DIM else 1.0
            show_picture(one, gain * data.arrays[f"{row}/{part}"])
            if row == "white":
                one.set_title(title if gain == 1.0 else f"{title} × {gain:g}")
        row_name(axes[0], label)
        note(axes[-2], f"SNR$_b$ {data.numbers['snr_b'][row]:.1f} dB")
