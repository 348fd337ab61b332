"""The colour maps of the page, each even in steps of lightness."""

from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np

from nearfar.markup import SCALE

STOPS = 33

Colour = tuple[int, int, int]


class ColourMap(NamedTuple):
    """A colour map, with colours that do not occur in it for what has no place on it.

    Attributes
    ----------
    stops : list of list of float
        Red, green and blue from 0 to 255, at even distances.
    none, none_name : tuple of int, str
        Where there is no value.
    negative, negative_name : list of list of float, str
        Values below zero of what should have none, by magnitude.
    """

    stops: list[list[float]]
    none: Colour
    none_name: str
    negative: list[list[float]]
    negative_name: str


# From the dark end of a map to a bright colour, which the map does not have.
_REDS = [[38.0, 20.0, 72.0], [125.0, 28.0, 82.0], [205.0, 62.0, 78.0], [255.0, 165.0, 130.0]]
_BLUES = [[4.0, 6.0, 20.0], [18.0, 62.0, 110.0], [30.0, 130.0, 190.0], [140.0, 220.0, 255.0]]


def _of_matplotlib(name: str) -> list[list[float]]:
    stops: list[list[float]] = np.rint(
        255 * np.asarray(mpl.colormaps[name](np.linspace(0, 1, STOPS)))[:, :3]
    ).tolist()
    return stops


_GREY, _PURPLE = (128, 128, 128), (120, 70, 170)

# By the name that a reader chooses; the first is that of reports.
COLOUR_MAPS: dict[str, ColourMap] = {
    "nearfar": ColourMap(SCALE.tolist(), _GREY, "grey", _REDS, "red"),
    "viridis": ColourMap(_of_matplotlib("viridis"), _GREY, "grey", _REDS, "red"),
    # It has grey in its middle.
    "cividis": ColourMap(_of_matplotlib("cividis"), _PURPLE, "purple", _REDS, "red"),
    "magma": ColourMap(_of_matplotlib("magma"), _GREY, "grey", _BLUES, "blue"),
    "grey": ColourMap(_of_matplotlib("gray"), _PURPLE, "purple", _REDS, "red"),
}


def describe_colour_maps() -> list[dict[str, Any]]:
    """Return the colour maps as JSON types."""
    return [{"name": name, **each._asdict()} for name, each in COLOUR_MAPS.items()]
