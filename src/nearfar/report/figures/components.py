"""Figures 2 and 4: the components of a scene, under white and under a picture."""

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

from nearfar.decibels import in_words
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
# Near- and far-range light is dim, so it is displayed with a gain, which the titles name.
DIM_PARTS = ("near", "far")
GAIN = 2.0


def draw(data: Data, picture: str) -> Figure:
    """Draw figure 2 or 4 from an acquired scene's data; `picture` names the second light."""
    figure = new_figure(2.85)
    draw_parts(figure, data, PARTS, picture, GAIN)
    return figure


def draw_parts(
    figure: Any, data: Data, parts: Mapping[str, str], picture: str, dim_gain: float
) -> None:
    """Draw parts of relit pictures, with titles, under white and under a picture.

    Parameters
    ----------
    figure : Figure or SubFigure
    data : Data
        With arrays ``white/PART`` and ``picture/PART``.
    parts : mapping
        Title of each part; ``sum`` and ``exact`` come last.
    picture : str
        Name of the second light.
    dim_gain : float
        Gain of near- and far-range light.
    """
    rows = {"white": "floodlight", "picture": picture}
    grid = figure.subplots(len(rows), len(parts))
    for axes, (row, label) in zip(grid, rows.items(), strict=True):
        for panel, (part, title) in zip(axes, parts.items(), strict=True):
            gain = dim_gain if part in DIM_PARTS else 1.0
            show_picture(panel, gain * data.arrays[f"{row}/{part}"])
            if row == "white":
                panel.set_title(title if gain == 1.0 else f"{title} × {gain:g}")
        row_name(axes[0], label)
        note(axes[-2], f"SNR$_b$ {in_words(data.numbers['snr_b'][row])}")
