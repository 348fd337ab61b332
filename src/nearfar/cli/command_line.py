"""The command line that was typed, for pages to show and for people to paste."""

import os
import re
import sys
from shlex import quote

from nearfar.cli.printable import CONTROLS


def command_line() -> str:
    """Return the command that runs, quoted for a shell."""
    return " ".join(["nearfar", *map(quoted, sys.argv[1:])])


def quoted(word: str) -> str:
    r"""Quote a word for a shell, with control characters as escapes that Bash and Zsh read.

    Examples
    --------
    >>> from nearfar.cli.command_line import quoted
    >>> print(quoted("my scene.zarr"), quoted("a\x1b[2J'b"))
    'my scene.zarr' $'a\033[2J\'b'
    """
    if not CONTROLS.search(word):
        return quote(word)
    escaped = re.sub(r"[\\']", lambda found: "\\" + found[0], word)
    return f"$'{CONTROLS.sub(_as_bytes, escaped)}'"


def _as_bytes(found: re.Match[str]) -> str:
    # Octal escapes end after three digits, whatever follows; those in hexadecimal may go on.
    return "".join(f"\\{byte:03o}" for byte in os.fsencode(found[0]))
