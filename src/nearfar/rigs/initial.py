"""A first RIG.toml, with a comment on each setting, from what is found."""

import json
from collections.abc import Sequence

from nearfar.rigs.cameras.base import FoundCamera
from nearfar.rigs.screens import Monitor

# What a driver's own table may hold, commented out.
OWN = {
    "aravis": """\
# Rows x columns to read, from the middle of the sensor.
# region = "1080x1440"
# Of those that are not packed, the one of most bits is chosen.
# pixel_format = "Mono12"
# "software", "free" (the camera runs by itself), or the line of a hardware trigger such as "Line1".
# trigger = "software"
# GenICam features to set first.
# features = { Gain = 0.0 }
""",
    "gphoto2": """\
# Settings by gphoto2's names; 'gphoto2 --list-config' lists them.
# settings = { iso = "100", "f-number" = "f/8" }
""",
    "opencv": """\
# Rows x columns of the picture.
# size = "1080x1920"
# Frames that the camera's queue holds.
# skip = 4
# OpenCV's properties without CAP_PROP_.
# properties = { GAMMA = 100.0, WB_TEMPERATURE = 5000.0 }
""",
    "folder": """\
# Run for each photo; {} is the folder. Without it, release the camera by hand.
# command = "gphoto2 --capture-image-and-download --filename {}/%n.%C"
# Seconds to wait for a photo.
# patience = 30.0
""",
}

ADVICE = """\
# Exposure in seconds, rounded to whole refreshes of the projector; "auto" takes white's photo.
exposure = "auto"
# Frames that are averaged to a photo.
# average = 4
"""

BRACKET = """\
# Exposures of a photo over the first and shortest, merged by their noise; calibrate first.
# bracket = [1.0, 4.0, 16.0]
"""


def draft_rig(monitors: Sequence[Monitor], cameras: Sequence[FoundCamera]) -> str:
    """Write a RIG.toml for the last monitor and the first camera; the others stand as comments.

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
        # The first is where people work.
        chosen = monitors[min(1, len(monitors) - 1)]
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
        "# Refreshes from a pattern's appearance to the exposure; found to be more where it is.",
        "# settle = 2",
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
        own = OWN[first.driver]
    else:
        lines += [
            "# No camera is found. Any camera that drops its photos into a folder will do:",
            'driver = "folder"',
            'path = "photos"',
        ]
        own = OWN["folder"]
    bracket = BRACKET if cameras and cameras[0].driver != "folder" else ""
    return "\n".join(lines) + "\n" + ADVICE + bracket + own


def _quoted(text: str) -> str:
    """Write a TOML string; JSON's are TOML's."""
    return json.dumps(_one_line(text), ensure_ascii=False)


def _one_line(text: str) -> str:
    return " ".join(text.split())
