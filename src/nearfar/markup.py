"""Fragments of HTML that need no other files: pictures are embedded."""

import base64
from collections.abc import Collection
from html import escape

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Booleans, Floats
from nearfar.files import encode_png, to_srgb

# From dark blue over teal to yellow, in even steps of lightness, so that it reads the same in grey.
SCALE = np.array(
    [[38, 20, 72], [52, 70, 140], [36, 120, 148], [50, 168, 130], [138, 205, 88], [248, 228, 60]],
    dtype=np.float64,
)

# Of saturated camera pixels, as in the style of `nearfar.report.page`: far from all of `SCALE` and
# from grey.
MARK = (214, 40, 90)


def picture(image: Floats, description: str) -> str:
    """Return an <img> of linear light, clipped to [0, 1] and shown as sRGB.

    Parameters
    ----------
    image : ndarray, shape (y, x) or (y, x, 3)
    description : str
        Alternative text.
    """
    return embedded(np.rint(255 * to_srgb(np.clip(image, 0, 1))).astype(np.uint8), description)


def embedded(pixels: NDArray[np.uint8], description: str) -> str:
    """Return an <img> of 8-bit pixels, (y, x) or (y, x, 3)."""
    data = base64.b64encode(encode_png(np.ascontiguousarray(pixels))).decode("ascii")
    return f'<img alt="{escape(description)}" src="data:image/png;base64,{data}">'


def false_colour(
    values: Floats, low: float, high: float, marked: Booleans | None = None
) -> NDArray[np.uint8]:
    """Map values from `low` to `high` to the colours of `SCALE`, uint8 (y, x, 3); NaN to grey.

    What is `marked` gets the colour `MARK`, whatever its value.
    """
    share = np.clip((np.nan_to_num(values, nan=low) - low) / max(high - low, 1e-12), 0, 1)
    position = share * (len(SCALE) - 1)
    below = np.minimum(position.astype(np.int64), len(SCALE) - 2)
    fraction = (position - below)[..., None]
    colours = SCALE[below] * (1 - fraction) + SCALE[below + 1] * fraction
    colours[~np.isfinite(values)] = 128
    if marked is not None:
        colours[marked] = MARK
    return np.asarray(np.rint(colours).astype(np.uint8))


BEST = ' class="best"'


def numbers(
    head: list[str],
    rows: list[list[str]],
    marked: Collection[int] = (),
    best: Collection[tuple[int, int]] = (),
) -> str:
    """Return a table of figures, in which the best ones are bold.

    Parameters
    ----------
    head : list of str
    rows : list of list of str
    marked : collection of int
        Numbers of rows that are bold.
    best : collection of (int, int)
        Row and column of single cells that are.
    """
    top = "".join(f'<th scope="col">{escape(name)}</th>' for name in head)
    body = "".join(
        ('<tr class="best">' if place in marked else "<tr>")
        + "".join(
            f"<td{BEST if (place, column) in best else ''}>{escape(cell)}</td>"
            for column, cell in enumerate(row)
        )
        + "</tr>"
        for place, row in enumerate(rows)
    )
    return f'<div class="wide"><table class="numbers"><tr>{top}</tr>{body}</table></div>'


def card(title: str, rows: list[tuple[str, str]], images: list[tuple[str, str]]) -> str:
    """Return the card that a notebook displays for an object: facts and small pictures.

    Parameters
    ----------
    title : str
    rows : list of (name, value)
    images : list of (name, <img>)
    """
    facts = "".join(
        f'<tr><th style="text-align:left;padding-right:1em;font-weight:500">{escape(name)}</th>'
        f'<td style="text-align:left">{escape(value)}</td></tr>'
        for name, value in rows
    )
    large = '<img style="width:100%;image-rendering:pixelated;border:1px solid #8888" '
    figures = "".join(
        f'<figure style="margin:0;width:140px">{one.replace("<img ", large)}'
        f'<figcaption style="font-size:.85em;opacity:.75">{escape(name)}</figcaption></figure>'
        for name, one in images
    )
    return (
        f"<div><b>{escape(title)}</b><table>{facts}</table>"
        f'<div style="display:flex;flex-wrap:wrap;gap:.8em;margin-top:.5em">{figures}</div></div>'
    )
