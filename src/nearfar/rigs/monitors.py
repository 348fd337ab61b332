"""Video outputs, and the window system that knows them."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from nearfar.arrays import Size
from nearfar.errors import DeviceError, InputError
from nearfar.packages import needed

# Refreshes a second of a monitor that does not report them.
DEFAULT_REFRESH_RATE = 60.0

# The window system once for each that uses it.
_USERS: list[Any] = []


@dataclass(frozen=True)
class Monitor:
    """A video output.

    Attributes
    ----------
    index : int
        0 is the main one.
    name : str
    size : Size
        In its pixels.
    place : tuple of int
        Its upper left corner (y, x) on the desktop.
    refresh : float
        Refreshes a second.
    """

    index: int
    name: str
    size: Size
    place: tuple[int, int]
    refresh: float

    def __str__(self) -> str:
        return f"{self.index}: {self.name}, {self.size} at {self.refresh:g} Hz"


def find_monitors() -> tuple[Monitor, ...]:
    """List the video outputs.

    Raises
    ------
    MissingPackageError
        If the window's packages are not installed.
    DeviceError
        If there is no display at all.
    """
    with window_system() as glfw:
        return monitors_of(glfw)


def choose_monitor(monitors: Sequence[Monitor], wanted: str | int | None) -> Monitor:
    """Choose a monitor by name or index; the only one, or the second, where nothing is wanted.

    Raises
    ------
    InputError
        If there is no such monitor, or more than one of that name.
    """
    if not monitors:
        raise DeviceError("no monitor is connected: connect the projector and turn it on.")
    if wanted is None:
        # The first monitor is usually the one that people work at.
        return monitors[min(1, len(monitors) - 1)]
    found = [m for m in monitors if wanted in {m.index, m.name}]
    if len(found) == 1:
        return found[0]
    listed = "; ".join(map(str, monitors))
    problem = "there is no monitor" if not found else "there are several monitors"
    raise InputError(f"{problem} {wanted!r}: name one of these by its index: {listed}.")


def dark_monitors(
    monitors: Sequence[Monitor], wanted: Sequence[str | int], lit: Monitor
) -> list[Monitor]:
    """Choose monitors to hold black, and refuse the one that shows patterns."""
    chosen = [choose_monitor(monitors, name) for name in wanted]
    if lit in chosen:
        raise InputError(
            f"monitor {lit.name} is to show patterns and to be held black: name the monitors of "
            f"other projectors alone under dark."
        )
    return chosen


@contextmanager
def window_system() -> Iterator[Any]:
    """Start the window system, GLFW, for as long as somebody uses it.

    Raises
    ------
    MissingPackageError
        If the window's packages are not installed.
    DeviceError
        If there is no display at all.
    """
    with needed(extra="window", what="a window on the projector"):
        import glfw
        import moderngl  # noqa: F401
    glfw.ERROR_REPORTING = "raise"
    try:
        there = glfw.init()
    except glfw.GLFWError as error:
        raise _no_display(str(error)) from None
    if not there:
        raise _no_display("no display")
    _USERS.append(glfw)
    try:
        yield glfw
    finally:
        _USERS.pop()
        # Terminating closes the windows of all.
        if not _USERS:
            glfw.terminate()


def _no_display(reason: str) -> DeviceError:
    return DeviceError(
        f"there is no display to show patterns on ({reason}): run where one is, or set DISPLAY."
    )


def monitors_of(glfw: Any) -> tuple[Monitor, ...]:
    """List the video outputs that a window system knows."""
    found = []
    for index, handle in enumerate(glfw.get_monitors()):
        mode = glfw.get_video_mode(handle)
        x, y = glfw.get_monitor_pos(handle)
        size = Size(mode.size.height, mode.size.width)
        refresh = float(mode.refresh_rate) or DEFAULT_REFRESH_RATE
        found.append(Monitor(index, text_of(glfw.get_monitor_name(handle)), size, (y, x), refresh))
    return tuple(found)


def handle_of(glfw: Any, monitor: Monitor) -> Any:
    """Return the window system's own object of a monitor."""
    return glfw.get_monitors()[monitor.index]


def text_of(name: bytes | str) -> str:
    """Return the name of a monitor as text."""
    return name.decode(errors="replace") if isinstance(name, bytes) else name
