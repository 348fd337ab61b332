"""``nearfar devices``."""

from typing import TYPE_CHECKING

from nearfar.cli.options import Quiet
from nearfar.cli.saying import say, warn

if TYPE_CHECKING:
    pass


def devices(quiet: Quiet = False) -> None:
    """List the monitors and cameras that are found.

    Example: nearfar devices
    """
    from nearfar.errors import DeviceError, MissingPackageError
    from nearfar.rigs.cameras.registry import find_cameras
    from nearfar.rigs.monitors import find_monitors

    say("monitors:", quiet=quiet)
    try:
        for monitor in find_monitors():
            say(f"  {monitor}", quiet=quiet)
    except (DeviceError, MissingPackageError) as error:
        warn(str(error))
    found, unable = find_cameras()
    say("cameras:", quiet=quiet)
    for camera in found:
        about = f'driver = "{camera.driver}", device = "{camera.device}"'
        say(f"  {about}: {camera.name}", quiet=quiet)
    if not found:
        say("  none is found: connect one, turn it on, and run this again", quiet=quiet)
    for sentence in unable:
        warn(sentence)
