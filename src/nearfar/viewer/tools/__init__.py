"""What can be done with a transport, for a page: each tool makes something of a light.

A tool takes a transport and the message of a page, and is an iterator: None after each step of its
work, so that what nobody waits for can be given up, and the message of its result at the end.
"""

from collections.abc import Callable, Iterator

from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.tools.compensation import compensating_light
from nearfar.viewer.tools.dual import seen_from_projector
from nearfar.viewer.tools.reach import by_distance, by_reach

Tool = Callable[[InteractiveTransport, bytes], Iterator[bytes | None]]

# By the last part of their address.
TOOLS: dict[str, Tool] = {
    "reach": by_reach,
    "distances": by_distance,
    "dual": seen_from_projector,
    "compensation": compensating_light,
}
