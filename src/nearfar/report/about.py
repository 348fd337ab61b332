"""The end of a page: the methods, ready to cite, the date, and the command line."""

import os
from datetime import UTC, datetime
from html import escape
from typing import NamedTuple

from nearfar.release import version

# Seconds since 1970 that pages are dated with, where builds are to be reproducible.
TIME_VARIABLE = "SOURCE_DATE_EPOCH"
PAPER = (
    "Reddy, D., Ramamoorthi, R., Curless, B.: Frequency-Space Decomposition and Acquisition of "
    "Light Transport under Spatially Varying Illumination. European Conference on Computer Vision "
    "(ECCV), 2012."
)
AUTHORS = "The nearfar developers"
TITLE = "nearfar: light transport between a projector and a camera"


class Methods(NamedTuple):
    """A paragraph of methods, for a publication.

    Attributes
    ----------
    text : str
        Refers to the references as [1], [2] and so on.
    references : tuple of str
    """

    text: str
    references: tuple[str, ...]


def software_reference() -> str:
    """Return the reference to nearfar, of the version that runs."""
    return f"{AUTHORS}: {TITLE}. Version {version()}."


def time_of_page() -> datetime:
    """Return the time that a page is dated with, in UTC: the one place where it is read.

    The environment may set it by `TIME_VARIABLE`; what is no number of seconds counts for nothing.
    """
    try:
        return datetime.fromtimestamp(int(os.environ[TIME_VARIABLE]), UTC)
    except (KeyError, ValueError, OverflowError, OSError):
        return datetime.now(UTC)


def about_page(methods: Methods | None, command: str | None) -> str:
    """Return the end of a page: its methods, and its date, nearfar's version, the command line.

    Parameters
    ----------
    methods : Methods, optional
    command : str, optional
        The command line; None for a page made in Python.
    """
    typed = "none: made in Python" if command is None else f"<code>{escape(command)}</code>"
    rows = [
        ("date", escape(f"{time_of_page():%Y-%m-%d %H:%M:%S} UTC")),
        ("nearfar", escape(version())),
        ("command line", typed),
    ]
    listed = "".join(f"<dt>{name}</dt><dd>{value}</dd>" for name, value in rows)
    return f'{_methods(methods)}<h2>About this page</h2>\n<dl class="about">{listed}</dl>'


def _methods(methods: Methods | None) -> str:
    if methods is None:
        return ""
    references = "".join(f"<li>{escape(each)}</li>" for each in methods.references)
    return (
        f"<h2>Methods, to cite</h2>\n<p>{escape(methods.text)}</p>\n"
        f'<ol class="references">{references}</ol>\n'
    )
