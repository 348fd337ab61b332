"""Figure 3: the components along a scan line, their ranks, rows, spectra, and the patterns."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from nearfar.arrays import Floats
from nearfar.report.figures.style import (
    COMPONENTS,
    LINES,
    bands,
    magnitude,
    new_figure,
    show_picture,
)
from nearfar.workflow.experiments.data import Data

PICTURE_GAINS = {"N": 2.0, "F": 2.0}


def draw(data: Data) -> Figure:
    """Draw figure 3 from the data of a scan line."""
    figure = new_figure(8.6)
    upper, rows, lower = bands(figure, [3.7, 2.5, 2.6])
    grid = upper.subplots(2, 4)
    top = float(np.abs(data.arrays["T"]).max())
    for name, picture, matrix in zip("TDNF", grid[0], grid[1], strict=True):
        gain = PICTURE_GAINS.get(name, 1.0)
        show_picture(picture, gain * data.arrays[f"picture/{name}"])
        picture.set_title(COMPONENTS[name] + (f" × {gain:g}" if gain != 1 else ""))
        picture.axhline(data.numbers["line"], color="#ffd400", linewidth=1.0, linestyle="--")
        image = magnitude(matrix, data.arrays[name], high=top)
        matrix.set_title(f"rank {data.numbers['ranks'][name]}")
        matrix.set_xlabel("projector pixel p")
    grid[0, 0].set_ylabel("(1) under floodlight")
    grid[1, 0].set_ylabel("(2) slice; camera pixel c")
    bar = upper.colorbar(image, ax=grid[1], shrink=0.9, pad=0.01)
    bar.set_label("log$_{10}$ entry, photo units")
    columns = data.arrays["columns"]
    for number, c in enumerate(columns, 1):
        grid[0, 0].plot(c, data.numbers["line"], "o", markersize=3.5, color="white", mec="black")
        grid[0, 0].annotate(
            f"c$_{number}$", (c, data.numbers["line"]), (3, 4), textcoords="offset points",
            fontsize=7, bbox={"boxstyle": "round,pad=0.1", "fc": "#ffffffbb", "ec": "none"},
        )  # fmt: skip
    plots = rows.subplots(1, 4)
    _draw_rows(data, plots)
    handles, labels = plots[0].get_legend_handles_labels()
    rows.legend(handles, labels, loc="outside lower center", ncols=4, handlelength=3)
    left, right = lower.subplots(1, 2, width_ratios=[1.15, 1.0])
    _draw_singular_values(data, left)
    _draw_patterns(data, right)
    return figure


def _draw_rows(data: Data, axes: Any) -> None:
    """Draw the rows of two camera pixels, and their spectra with k_far and k_near."""
    for number, c in enumerate(data.arrays["columns"], 1):
        row, spectrum = axes[number - 1], axes[number + 1]
        for name, label in COMPONENTS.items():
            values = data.arrays[name][int(c)]
            row.semilogy(np.maximum(values, 1e-9), label=label, **LINES[name])
            amplitude = np.abs(np.fft.rfft(data.arrays[f"{name}/along"][number - 1]))
            spectrum.semilogy(np.maximum(amplitude, 1e-9), **LINES[name])
        row.set_ylim(bottom=_floor(data.arrays["F"][int(c)]))
        row.set_title(f"(3) row of c$_{number}$")
        row.set_xlabel("projector pixel p")
        spectrum.set_title(f"(4) its spectrum, c$_{number}$")
        spectrum.set_xlabel("k$_x$ at k$_y$ = 0, cycles")
        whole = float(data.arrays["T/along"][number - 1].sum())
        spectrum.set_ylim(whole * 1e-5, whole * 6)
        for k, name in zip(("k_far", "k_near"), ("k$_{far}$", "k$_{near}$"), strict=True):
            spectrum.axvline(data.numbers[k], color="#888888", linewidth=0.8, linestyle=":")
            spectrum.annotate(
                name, (data.numbers[k], spectrum.get_ylim()[1]), (2, -9),
                textcoords="offset points", color="#555555",
            )  # fmt: skip
    axes[0].set_ylabel("entry, photo units")
    axes[2].set_ylabel("|DFT|")


def _floor(values: Floats) -> float:
    positive = values[values > 0]
    return float(np.percentile(positive, 5) / 3) if len(positive) else 1e-9


def _draw_singular_values(data: Data, axes: Axes) -> None:
    for name, label in COMPONENTS.items():
        values = data.arrays[f"{name}/singular"]
        number = np.arange(1, len(values) + 1)
        axes.semilogy(number, np.maximum(values, 1e-12), label=label, **LINES[name])
    strongest = float(data.arrays["T/singular"][0])
    limit = data.numbers["rank_above"] * strongest
    axes.axhline(limit, color="#888888", linewidth=0.8, linestyle=":")
    axes.annotate(
        "rank counts those above", (128, limit), (-2, 2), textcoords="offset points", ha="right",
        color="#555555", fontsize=7,
    )  # fmt: skip
    axes.set_ylim(strongest * 1e-6, strongest * 3)
    axes.set_title("(2) singular values of each slice")
    axes.set_xlabel("number")
    axes.set_ylabel("singular value")
    axes.legend(loc="lower right")


def _draw_patterns(data: Data, axes: Axes) -> None:
    """Draw the frequencies of the plan's patterns."""
    near, far = data.arrays["near"], data.arrays["far"]
    for name, k, marker, size, colour in (
        ("near-range", near, "o", 2.6, "#c2561a"),
        ("far-range", far, "s", 1.8, "#1d6b4b"),
    ):
        axes.plot(k[:, 1], k[:, 0], marker, markersize=size, color=colour, label=name, mew=0)
    for y in (-0.5, 0.5):
        axes.plot(
            [-0.5, 0.5], [y, y], "D", markersize=5, color="#1f4e9c", clip_on=False,
            label="direct" if y < 0 else None,
        )  # fmt: skip
    axes.set_aspect("equal")
    axes.set_xlim(-0.52, 0.52)
    axes.set_ylim(0.52, -0.52)
    axes.set_title("(5) the patterns' frequencies")
    axes.set_xlabel("k$_x$, cycles per projector pixel")
    axes.set_ylabel("k$_y$, cycles per pixel")
    axes.legend(loc="center left", bbox_to_anchor=(1.02, 0.5))
