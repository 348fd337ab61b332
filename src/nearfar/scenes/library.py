"""The built-in scenes by name."""

from nearfar.scenes.cornell import cornell
from nearfar.scenes.corner import corner
from nearfar.scenes.geometry import Scene
from nearfar.scenes.wedge import wedge


def describe(name: str) -> Scene:
    """Describe a built-in scene (a name of `nearfar.scenes.NAMES`)."""
    if name == "wedge":
        return wedge()
    if name == "corner":
        return corner()
    return cornell(aside=name == "cornell-aside")
