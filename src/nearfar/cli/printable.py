"""Text of files and their names on a terminal, which would obey the control characters in it."""

import re

# Control characters, line separators, what turns the direction of text, and bytes of a name that
# are no text.
CONTROLS = re.compile(
    "[\x00-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff]"
)


def printable(text: str, *, keep: str = "") -> str:
    r"""Write control characters as escapes, such as ``\x1b``.

    Parameters
    ----------
    text : str
    keep : str
        Those that stay, such as the ends of lines in a text of several.

    Returns
    -------
    str

    Examples
    --------
    >>> from nearfar.cli.printable import printable
    >>> print(printable("a\x1b[2Jb\n"))
    a\x1b[2Jb\n
    """
    return CONTROLS.sub(lambda found: _written(found[0], keep), text)


def _written(character: str, keep: str) -> str:
    return character if character in keep else ascii(character)[1:-1]
