"""The layout of a transport's file: versions, names of attributes, checks of numbers."""

from typing import Any

from nearfar.arrays import Size, as_size
from nearfar.transport.parts import Parts
from nearfar.transport.posterior_store import listed
from nearfar.transport.rows import FACTORS

KIND = "nearfar transport"
# Version 2 added functions of near-range light that are of several projector pixels, and
# footprints. Version 3 added transports without direct, near- or far-range light, and posteriors of
# estimates from any patterns and of free rows. Version 4 added direct light from second places.
# Other transports of single pixels are still written
# as version 1, which older versions of nearfar read.
VERSION_OF_PIXELS, VERSION_OF_HATS, VERSION_OF_OTHERS, VERSION_OF_SECOND_PLACES = 1, 2, 3, 4
READABLE_VERSIONS = (
    VERSION_OF_PIXELS,
    VERSION_OF_HATS,
    VERSION_OF_OTHERS,
    VERSION_OF_SECOND_PLACES,
)

# Of a projector or a camera in a file, in pixels.
LARGEST_SIDE = 2**20

# Characters of a message that are quoted from a file.
MAXIMUM_REASON = 200

# Attribute of the verdict on a transport, which is not there where none was passed.
VERDICT = "verdict"
# Whether there are arrays of second places, as from every joint estimate at a pitch of 1.
SECOND = "second_places"
# That of the parts of a transport that has not the usual ones.
PARTS_OF_T = "parts"

# An optional part of a transport is stored as a mapping in the attributes and as arrays named
# PART_FIELD. The posterior and some of its fields have older names in the format.
POSTERIOR, QUALITY = "belief", "quality"
STORED_PARTS = {"posterior": POSTERIOR, "quality": QUALITY}


def factors_of(parts: Parts) -> tuple[str, ...]:
    """Return the factors that a transport of some parts has in a file."""
    has_far = not {"far", "free"}.isdisjoint(parts)
    absent = {"near": "near" not in parts, "far": not has_far}
    absent |= dict.fromkeys(("correspondence", "direct"), "direct" not in parts)
    return tuple(name for name in FACTORS if not absent.get(name, False))


def stored_size(value: Any) -> Size:
    """Return a size from JSON; ValueError or TypeError if it is none, or larger than any."""
    size = as_size(listed(value))
    if max(size) > LARGEST_SIDE:
        raise ValueError(f"a side is over {LARGEST_SIDE}")
    return size


def stored_pitch(attributes: Any) -> int:
    """Return the pitch of a transport from its attributes; ValueError if it is none."""
    pitch = attributes.get("pitch", 1)
    if not isinstance(pitch, int) or not 1 <= pitch <= LARGEST_SIDE:
        raise ValueError(f"{pitch!r} is no pitch")
    return pitch


def mapped(value: Any) -> dict[str, Any]:
    """Return a JSON object; TypeError if it is none."""
    if not isinstance(value, dict):
        raise TypeError(f"{value!r} is no mapping")
    return value
