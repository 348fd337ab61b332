"""Figure 6: this method and compressive light transport under four lights."""

from matplotlib.figure import Figure

from nearfar.report.figures.style import new_figure, note, row_name, show_picture
from nearfar.workflow.experiments.data import Data

LIGHTS = {
    "white": "floodlight",
    "picture": "natural picture",
    "letters": "fine detail",
    "random": "random",
}
METHODS = {"sum": "this method", "CLT": "CLT"}


def draw(data: Data) -> Figure:
    """Draw figure 6 from the rivals' data."""
    snr_b = {"sum": data.numbers["snr_b"], "CLT": data.numbers["CLT"]["snr_b"]}
    figure = new_figure(5.0)
    grid = figure.subplots(2 + len(METHODS), len(LIGHTS))
    for column, (light, title) in zip(grid.T, LIGHTS.items(), strict=True):
        show_picture(column[0], data.arrays[f"{light}/light"])
        show_picture(column[1], data.arrays[f"{light}/exact"])
        column[0].set_title(title)
        for axes, method in zip(column[2:], METHODS, strict=True):
            show_picture(axes, data.arrays[f"{light}/{method}"])
            note(axes, f"SNR$_b$ {snr_b[method][light]:.1f} dB")
    for axes, label in zip(grid[:, 0], ("light", "exact", *METHODS.values()), strict=True):
        row_name(axes, label)
    return figure
