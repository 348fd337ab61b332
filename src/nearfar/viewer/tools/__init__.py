"""What can be done with a transport, for a page: each tool makes something of a light.

A tool takes a transport and the message of a page, and is an iterator: None after each step of its
work, so that what nobody waits for can be given up, and the message of its result at the end.
"""

from collections.abc import Callable, Iterator
from functools import partial

from nearfar.viewer.beside import Beside
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.physical import PhysicalRelighting
from nearfar.viewer.tools.beside import picture_beside
from nearfar.viewer.tools.compensation import compensating_light
from nearfar.viewer.tools.dual import seen_from_projector
from nearfar.viewer.tools.error_bars import error_bars_of_picture
from nearfar.viewer.tools.parts import parts_of_picture
from nearfar.viewer.tools.reach import by_distance, by_reach
from nearfar.viewer.tools.region import region_of

Tool = Callable[[InteractiveTransport, bytes], Iterator[bytes | None]]

# Of a transport alone, by the last part of their address.
TOOLS: dict[str, Tool] = {
    "reach": by_reach,
    "distances": by_distance,
    "dual": seen_from_projector,
    "compensation": compensating_light,
}


def tools_of(physical: PhysicalRelighting, beside: Beside | None) -> dict[str, Tool]:
    """Return the tools of a page, by the last part of their address.

    Parameters
    ----------
    physical : PhysicalRelighting
        Of the page's transport.
    beside : Beside, optional
        The second transport.
    """
    tools: dict[str, Tool] = {
        **TOOLS,
        "error-bars": partial(error_bars_of_picture, physical),
        "region": partial(region_of, physical),
        "parts": partial(parts_of_picture, physical),
    }
    return tools if beside is None else {**tools, "beside": partial(picture_beside, beside)}
