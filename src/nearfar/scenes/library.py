"""The built-in scenes by name."""

from collections.abc import Callable
from functools import partial

from nearfar.scenes.alcove import alcove
from nearfar.scenes.cornell import cornell
from nearfar.scenes.corner import corner
from nearfar.scenes.geometry import Scene
from nearfar.scenes.shelf import shelf
from nearfar.scenes.wedge import wedge

_DESCRIBED: dict[str, Callable[[], Scene]] = {
    "cornell": cornell,
    "cornell-aside": partial(cornell, aside=True),
    "wedge": wedge,
    "corner": corner,
    "alcove": alcove,
    "shelf": shelf,
}


def describe(name: str) -> Scene:
    """Describe a built-in scene (a name of `nearfar.scenes.NAMES`)."""
    return _DESCRIBED[name]()
