"""Figure 5: the wedge by theory, SNR_b over all frequencies and SNR_t over all camera pixels."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nearfar.arrays import Floats
from nearfar.decibels import in_words
from nearfar.report.figures.components import PARTS, draw_parts
from nearfar.report.figures.style import (
    SEQUENTIAL,
    bands,
    centred_extent,
    new_figure,
)
from nearfar.workflow.experiments.data import Data

# Of near- and far-range light.
GAIN = 4.0
# In dB: the lower bound that the paper states, over all frequencies and camera pixels of its scene.
PAPER_SNR = 25.0


def draw(data: Data) -> Figure:
    """Draw figure 5 from the wedge's data."""
    figure = new_figure(4.9)
    upper, lower = bands(figure, [2.35, 2.55])
    parts = {part: title for part, title in PARTS.items() if part != "light"}
    draw_parts(upper, data, parts, "picture", GAIN)
    left, right = lower.subplots(1, 2)
    size = data.numbers["projector"]
    _draw_map(left, data.arrays["snr_b"], extent=centred_extent(size))
    left.set_title("SNR$_b$ under every frequency")
    left.set_xlabel("k$_x$, cycles across the projector")
    left.set_ylabel("k$_y$, cycles down")
    y, x = data.numbers["lowest_frequency"]
    _mark(left, x, y, data.arrays["snr_b"])
    _draw_map(right, data.arrays["snr_t"])
    right.set_title("SNR$_t$ of every camera pixel")
    right.set_xlabel("c$_x$, camera pixel")
    right.set_ylabel("c$_y$")
    y, x = data.numbers["lowest_camera_pixel"]
    _mark(right, x, y, data.arrays["snr_t"])
    return figure


def _draw_map(axes: Axes, values: Floats, extent: Any = None) -> None:
    # Without noise the far band is exact: its SNR would take up the whole colour scale.
    high = float(np.nanpercentile(values, 98))
    image = axes.imshow(values, cmap=SEQUENTIAL, vmin=PAPER_SNR, vmax=high, extent=extent)
    figure = axes.get_figure()
    assert figure is not None
    bar = figure.colorbar(image, ax=axes, shrink=0.82, extend="both")
    bar.set_label(f"dB; the paper: at least {PAPER_SNR:g}")


def _mark(axes: Axes, x: int, y: int, values: Floats) -> None:
    axes.plot(x, y, "o", markersize=7, mfc="none", mec="#ff3b30", mew=1.2)
    left, right = sorted(axes.get_xlim())
    side = -1 if x > (left + right) / 2 else 1
    axes.annotate(
        f"lowest {in_words(float(np.nanmin(values)))}",
        (x, y), (8 * side, 8), textcoords="offset points",
        ha="right" if side < 0 else "left", color="white", fontsize=7,
        bbox={"boxstyle": "round,pad=0.15", "fc": "#00000099", "ec": "none"},
    )  # fmt: skip
