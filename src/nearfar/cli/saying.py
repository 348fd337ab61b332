"""What a command says: on stdout for people, on stderr what is wrong."""

import sys


def say(text: str, *, quiet: bool = False) -> None:
    """Print a line for people on stdout."""
    if not quiet:
        print(text)


def warn(text: str) -> None:
    """Print a warning on stderr."""
    print(f"warning: {text}", file=sys.stderr)
