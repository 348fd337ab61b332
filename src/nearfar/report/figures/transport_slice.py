"""Figure 1: a slice of a transport matrix in log scale, and its singular values."""

import numpy as np
from matplotlib.figure import Figure

from nearfar.report.figures.style import LINES, magnitude, new_figure, show_picture
from nearfar.workflow.experiments.data import Data


def draw(data: Data) -> Figure:
    """Draw figure 1 from an acquired scene's data."""
    figure = new_figure(2.15)
    scene, matrix, truth, values = figure.subplots(1, 4, width_ratios=[1.0, 1.0, 1.0, 1.1])
    exact = data.arrays["white/exact"]
    show_picture(scene, exact)
    scene.axhline(data.numbers["line"], color="#4aa8ff", linewidth=1.2)
    scene.set_title("(a) scene, floodlit")
    scene.set_xlabel("blue: the slice's row")

    found, known = data.arrays["slice"], data.arrays["slice/exact"]
    high = float(np.abs(known).max())
    for axes, part, title in (
        (matrix, found, "(b) slice of T, acquired"),
        (truth, known, "(c) the same, exact"),
    ):
        image = magnitude(axes, part, high=high)
        axes.set_title(title)
        axes.set_xlabel("projector pixel p")
    matrix.set_ylabel("camera pixel c")
    bar = figure.colorbar(image, ax=[matrix, truth], shrink=0.72, pad=0.02)
    bar.set_label("log$_{10}$ |T(c, p)|")

    low = 0.0
    for name, array, style in (
        ("exact", "slice/exact", LINES["T"]),
        ("acquired", "slice", LINES["D"]),
    ):
        singular = data.arrays[f"{array}/singular"]
        low = min(low, float(np.log10(singular[-1])))
        values.semilogy(np.arange(1, len(singular) + 1), singular, label=name, **style)
    values.set_title("(d) singular values")
    values.set_xlabel("number")
    values.set_ylim(*(10.0 ** np.array([np.floor(low), 0.2])))
    values.set_box_aspect(1)
    values.legend(loc="lower left")
    return figure
