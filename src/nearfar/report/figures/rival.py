"""Figure 6: this method and compressive light transport under four lights."""

import numpy as np
from matplotlib.figure import Figure

from nearfar.decibels import in_words
from nearfar.report.figures.style import new_figure, note, row_name, show_picture
from nearfar.workflow.experiments.data import Data

LIGHTS = {
    "white": "floodlight",
    "picture": "natural picture",
    "letters": "fine detail",
    "random": "random",
}
METHODS = {"sum": "this method", "CLT": "CLT"}
ERROR_GAIN = 50.0


def draw(data: Data) -> Figure:
    """Draw figure 6 from the rivals' data."""
    snr_b = {"sum": data.numbers["snr_b"], "CLT": data.numbers["CLT"]["snr_b"]}
    figure = new_figure(7.4)
    grid = figure.subplots(2 + 2 * len(METHODS), len(LIGHTS))
    for column, (light, title) in zip(grid.T, LIGHTS.items(), strict=True):
        show_picture(column[0], data.arrays[f"{light}/light"])
        show_picture(column[1], data.arrays[f"{light}/exact"])
        column[0].set_title(title)
        for axes, error, method in zip(column[2::2], column[3::2], METHODS, strict=True):
            relit = data.arrays[f"{light}/{method}"]
            show_picture(axes, relit)
            show_picture(error, ERROR_GAIN * np.abs(relit - data.arrays[f"{light}/exact"]))
            note(error, f"SNR$_b$ {in_words(snr_b[method][light])}")
    names = [name for label in METHODS.values() for name in (label, f"error × {ERROR_GAIN:g}")]
    for axes, label in zip(grid[:, 0], ("light", "exact", *names), strict=True):
        row_name(axes, label)
    return figure
