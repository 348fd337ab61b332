"""A first RIG.toml, with a comment on each setting, from what is found."""

import json
from collections.abc import Sequence

from nearfar.rigs.cameras.driver import FoundCamera
from nearfar.rigs.cameras.registry import CAMERAS
from nearfar.rigs.monitors import Monitor, choose_monitor

ADVICE = """\
# Exposure in seconds, rounded to whole refreshes of the projector; "auto" fits it to white.
exposure = "auto"
# Frames that are averaged to a photo.
# average = 4
"""

BRACKET = """\
# Exposures of a photo over the first and shortest, merged by their noise; calibrate first.
# bracket = [1.0, 4.0, 16.0]
"""


def draft_rig(monitors: Sequence[Monitor], cameras: Sequence[FoundCamera]) -> str:
    """Write a RIG.toml for the second monitor, or the only one, and the first camera.

    The others stand in it as comments.

    Parameters
    ----------
    monitors : sequence of Monitor
    cameras : sequence of FoundCamera

    Returns
    -------
    str
        TOML, which reads as it stands.
    """
    lines = [
        "# A real rig: what shows the patterns and what photographs them.",
        "# Next: nearfar preview to aim and focus, nearfar calibrate for its response, and then",
        "# nearfar acquire. Remove the # before a setting to use it.",
        "",
        "[projector]",
        "# Name or index, as nearfar devices lists them.",
    ]
    if monitors:
        chosen = choose_monitor(monitors, None)
        named = [m.name for m in monitors].count(chosen.name) == 1
        lines.append(f"monitor = {_quoted(chosen.name) if named else chosen.index}  # {chosen}")
        lines += [f"# monitor = {m.index}  # {m}" for m in monitors if m != chosen]
    else:
        lines.append("# No monitor is found: connect the projector, and give its index here.")
        lines.append("# monitor = 1")
    lines += [
        "# Side of a pattern pixel in the projector's; the largest that fits if left out.",
        "# scale = 8",
        "# Light of a white pattern over the projector's full white.",
        "# brightness = 0.5",
        "# Refreshes from a pattern's display to the exposure; raised where photos show the need.",
        "# settle = 2",
        "# Monitors of other projectors before this camera, which are held black.",
        "# dark = [2]",
        "",
        "[camera]",
    ]
    if cameras:
        first, *others = cameras
        lines += [
            f'driver = "{first.driver}"',
            f"device = {_quoted(first.device)}  # {_one_line(first.name)}",
        ]
        lines += [
            f'# {_one_line(c.name)}: driver = "{c.driver}", device = {_quoted(c.device)}'
            for c in others
        ]
        general, own = ADVICE + BRACKET, CAMERAS[first.driver].settings
    else:
        lines += [
            "# No camera is found. Any camera that drops its photos into a folder will do:",
            'driver = "folder"',
            'path = "photos"',
        ]
        # The exposure of such a camera is set by hand, so there is no bracket.
        general, own = ADVICE, CAMERAS["folder"].settings
    return "\n".join(lines) + "\n" + general + own


def _quoted(text: str) -> str:
    """Write a TOML string; JSON's are TOML's."""
    return json.dumps(_one_line(text), ensure_ascii=False)


def _one_line(text: str) -> str:
    return " ".join(text.split())
