"""Relit pictures beside known ones, or photos, with their differences."""

from collections.abc import Mapping

import numpy as np

from nearfar.markup import picture
from nearfar.report.differences import difference_gain
from nearfar.report.page import gallery
from nearfar.report.transport_page import visible
from nearfar.workflow.judge import Pair


def pictures_beside(pairs: Mapping[str, Pair], exposure: float, known: str) -> str:
    """Return a table of lights, relit pictures, known ones and differences as HTML.

    Parameters
    ----------
    pairs : mapping of str to Pair
        By the light's name.
    exposure : float
        Gain at which pictures are shown.
    known : str
        What the known pictures are, in a word.
    """
    gain = difference_gain(exposure * (pair.relit - pair.known) for pair in pairs.values())
    rows = [(name, _cells(name, pair, exposure, gain, known)) for name, pair in pairs.items()]
    times = f"{gain} times " if gain > 1 else ""
    return (
        f"<p>Differences are shown {times}as bright as the pictures beside them.</p>\n"
        f"{gallery(['light', 'relit', known, f'difference × {gain}'], rows)}"
    )


def _cells(name: str, pair: Pair, exposure: float, gain: int, known: str) -> list[str]:
    difference = gain * np.abs(pair.relit - pair.known)
    images = {"relit": pair.relit, known: pair.known, "difference": difference}
    return [picture(pair.light, f"light: {name}")] + [
        picture(visible(exposure * image), f"{what} under {name}") for what, image in images.items()
    ]
