"""The parts that a transport is split into.

Most have direct, near- and far-range light. A projector of few lamps, or lamps without neighbours,
may have no near or no far range, and light stages have no projector pixel that lights a camera
pixel directly. A part that a transport does not have is absent: it has no functions and no numbers.
Where neither range is modelled, every row is free: light from each lamp is a number of its own.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Literal, get_args

from nearfar.errors import InputError

Part = Literal["direct", "near", "far", "free"]
Parts = tuple[Part, ...]

PARTS: Parts = get_args(Part)
USUAL_PARTS: Parts = ("direct", "near", "far")
# Where each stands among direct, near and far: free rows take the place of far-range light.
PLACES: Mapping[Part, int] = {"direct": 0, "near": 1, "far": 2, "free": 2}


def require_parts(parts: Parts, wanted: Iterable[str]) -> None:
    """Refuse parts that a transport does not have.

    Parameters
    ----------
    parts : tuple of str
        Of the transport.
    wanted : iterable of str

    Raises
    ------
    InputError
        If one is not among `parts`.
    """
    for name in wanted:
        if name not in parts:
            raise InputError(
                f"this transport has no part {name!r}, for it was made without: it has "
                f"{' and '.join(parts)}."
            )


def parts_from_json(value: Any) -> Parts:
    """Read the parts of a transport from its file.

    Raises
    ------
    ValueError, TypeError
        If these are no parts of a transport.
    """
    found = tuple(part for part in PARTS if part in value)
    if not found or list(found) != list(value) or ("free" in found and "far" in found):
        raise ValueError(f"{value!r} are no parts of a transport")
    return found
