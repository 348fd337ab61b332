"""The style of the figures, with colours that can be told apart in grey prints.

Figures are made without pyplot, so that a user's own plots and settings stay as they are.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.typing import RcKeyType

from nearfar.arrays import Floats
from nearfar.files import to_srgb

# In inches: about the width of a page's text.
FIGURE_WIDTH = 7.2
DPI = 200
# Perceptually uniform, so that it reads the same in grey.
SEQUENTIAL = "viridis"
# From black, so that small values vanish as in the paper's figures.
MAGNITUDE = "magma"
# Lines differ in lightness and in dashes.
LINES: dict[str, dict[str, Any]] = {
    "T": {"color": "#111111", "linestyle": "-"},
    "D": {"color": "#1f4e9c", "linestyle": "--"},
    "N": {"color": "#c2561a", "linestyle": "-."},
    "F": {"color": "#3f9e74", "linestyle": (0, (1, 1.2))},
}
COMPONENTS = {"T": "full T", "D": "direct D", "N": "near-range N", "F": "far-range F"}

_SETTINGS: dict[RcKeyType, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "legend.fontsize": 7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.1,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
    "image.interpolation": "none",
    # Text stays text in the vector file.
    "pdf.fonttype": 42,
}


@contextmanager
def styled() -> Iterator[None]:
    """Apply the project's style on top of matplotlib's defaults, ignoring the user's settings."""
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_SETTINGS)
        yield


def new_figure(height: float, width: float = FIGURE_WIDTH) -> Figure:
    """Return a figure of the page's width, or of another, `height` inches high."""
    return Figure(figsize=(width, height))


def bands(figure: Figure, heights: Sequence[float]) -> list[SubFigure]:
    """Divide a figure into bands across the page, of these heights in inches."""
    return list(np.ravel(np.asarray(figure.subfigures(len(heights), 1, height_ratios=heights))))


def save(figure: Figure, folder: Path, name: str) -> None:
    """Write NAME.pdf and NAME.png; the same figure gives the same bytes."""
    with styled():
        figure.savefig(folder / f"{name}.pdf", metadata={"CreationDate": None}, dpi=DPI)
        figure.savefig(folder / f"{name}.png", metadata={"Software": None}, dpi=DPI)


def show_picture(axes: Axes, picture: Floats) -> None:
    """Draw linear light, clipped to [0, 1], as sRGB, without ticks."""
    encoded = to_srgb(np.clip(np.nan_to_num(picture), 0, 1))
    if encoded.ndim == 3 and encoded.shape[2] == 1:
        encoded = encoded[..., 0]
    axes.imshow(encoded, cmap="gray", vmin=0, vmax=1)
    axes.set_xticks([])
    axes.set_yticks([])


def note(axes: Axes, text: str) -> None:
    """Write a line under a picture."""
    axes.set_xlabel(text, labelpad=2)


def row_name(axes: Axes, text: str) -> None:
    """Write a row's name at the left of its first picture."""
    axes.set_ylabel(text, labelpad=3)


def magnitude(axes: Axes, values: Floats, *, high: float, decades: float = 5.0) -> Any:
    """Draw |values| on a log scale that ends `decades` below `high`; return the image."""
    logarithms = np.log10(np.maximum(np.abs(values), high * 10.0**-decades))
    return axes.imshow(
        logarithms, cmap=MAGNITUDE, vmin=np.log10(high) - decades, vmax=np.log10(high)
    )


def centred_extent(size: Sequence[int]) -> tuple[float, float, float, float]:
    """Return the extent of a map over DFT frequencies: DC in the middle, ky downwards."""
    height, width = size
    return (
        -(width // 2) - 0.5,
        width - width // 2 - 0.5,
        height - height // 2 - 0.5,
        -(height // 2) - 0.5,
    )
