"""A projector on a video output: a window that shows frames pixel for pixel.

Index convention: frames are (height, width) for grey or (height, width, 3), 8 bits, at the
monitor's native size.
"""

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from types import TracebackType
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import DeviceError, InputError
from nearfar.packages import needed
from nearfar.rigs.monitors import (
    Monitor,
    choose_monitor,
    dark_monitors,
    handle_of,
    monitors_of,
    text_of,
    window_system,
)

# Seconds between readings of the keyboard while waiting.
KEYBOARD_INTERVAL_SECONDS = 0.01
# Refreshes that are timed. The measured period counts if it is within this share of the nominal.
TIMED_REFRESHES = 24
PERIOD_TOLERANCE = 0.02

VERTEX_SHADER = """
#version 330
void main() {
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(2.0 * corner - 1.0, 0.0, 1.0);
}
"""
# Each pixel fetches its own value: no filter, no scaling; the first row is at the top.
FRAGMENT_SHADER = """
#version 330
uniform sampler2D frame;
out vec4 colour;
void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    colour = texelFetch(frame, ivec2(place.x, textureSize(frame, 0).y - 1 - place.y), 0);
}
"""


class Screen(Protocol):
    """A display of frames."""

    @property
    def monitor(self) -> Monitor:
        """The screen that patterns are displayed on."""
        ...

    @property
    def period(self) -> float:
        """Seconds from one refresh to the next, as measured."""
        ...

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a frame and return once it is on the way to the projector."""
        ...

    def close(self) -> None:
        """Give the monitor back."""
        ...

    def wait(self, seconds: float) -> None:
        """Let time pass; the user may stop it by Esc.

        Raises
        ------
        KeyboardInterrupt
            If Esc was pressed.
        """
        ...


class Window:
    """A full-screen window on a monitor; shows frames pixel for pixel, in step with its refresh.

    Use it as a context, on the main thread. The pointer is hidden, and the system is asked to
    leave its screen saver off.

    Parameters
    ----------
    wanted : str or int, optional
        Monitor's name or index; see `choose_monitor`.
    dark : sequence of str or int
        Monitors of other projectors, which are held black meanwhile.

    Raises
    ------
    MissingPackageError, DeviceError, InputError
    """

    def __init__(self, wanted: str | int | None = None, dark: Sequence[str | int] = ()) -> None:
        self._stack = ExitStack()
        try:
            self._glfw = self._stack.enter_context(window_system())
            monitors = monitors_of(self._glfw)
            self.monitor = choose_monitor(monitors, wanted)
            others = dark_monitors(monitors, dark, self.monitor)
            self._stack.enter_context(_kept_awake())
            self._stopped = self._gone = False
            self._dark: list[Window] = []
            self._open()
            self._dark = [self._stack.enter_context(Window(other.index)) for other in others]
            for window in self._dark:
                window.show(np.zeros(window.monitor.size, dtype=np.uint8))
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        _kind: type[BaseException] | None,
        _fault: BaseException | None,
        _trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Give the monitor back."""
        self._stack.close()

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a frame, (height, width) or (height, width, 3), of the monitor's size.

        Raises
        ------
        InputError
            If it is of another size.
        DeviceError
            If the monitor is gone.
        KeyboardInterrupt
            If Esc was pressed.
        """
        if frame.shape[:2] != tuple(self.monitor.size):
            raise InputError(
                f"a frame of shape {frame.shape} is not of the monitor's {self.monitor.size}."
            )
        colour = np.broadcast_to(np.atleast_3d(frame), (*self.monitor.size, 3))
        # Another window's may be the current one.
        self._glfw.make_context_current(self._handle)
        self._texture.write(np.ascontiguousarray(colour).tobytes())
        self._texture.use()
        # Twice: of the two buffers that take turns, a window may be shown either when it has been
        # hidden for a moment.
        for _ in range(2):
            self._pixels.render(mode=self._triangles, vertices=3)
            self._glfw.swap_buffers(self._handle)
        # Until the second swap has come, the first frame is on the screen.
        self._context.finish()
        self._listen()

    def wait(self, seconds: float) -> None:
        """Let time pass; the user may stop it by Esc.

        Raises
        ------
        DeviceError
            If the monitor is gone.
        KeyboardInterrupt
            If Esc was pressed.
        """
        until = time.monotonic() + seconds
        self._listen()
        while (left := until - time.monotonic()) > 0:
            time.sleep(min(left, KEYBOARD_INTERVAL_SECONDS))
            self._listen()

    def _listen(self) -> None:
        self._glfw.poll_events()
        if self._gone:
            raise DeviceError(
                f"monitor {self.monitor.name} is gone: connect the projector again and turn it on."
            )
        if self._stopped or self._glfw.window_should_close(self._handle):
            raise KeyboardInterrupt
        for window in self._dark:
            window._listen()

    def _open(self) -> None:
        import moderngl

        glfw, size = self._glfw, self.monitor.size
        handle = handle_of(glfw, self.monitor)
        mode = glfw.get_video_mode(handle)
        for hint, value in (
            (glfw.CONTEXT_VERSION_MAJOR, 3),
            (glfw.CONTEXT_VERSION_MINOR, 3),
            (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
            (glfw.OPENGL_FORWARD_COMPAT, True),
            # It stays although another window is clicked.
            (glfw.AUTO_ICONIFY, False),
            # The mode it is in: switching takes seconds, and scales.
            (glfw.RED_BITS, mode.bits.red),
            (glfw.GREEN_BITS, mode.bits.green),
            (glfw.BLUE_BITS, mode.bits.blue),
            (glfw.REFRESH_RATE, mode.refresh_rate or glfw.DONT_CARE),
        ):
            glfw.window_hint(hint, value)
        try:
            self._handle: Any = glfw.create_window(size.width, size.height, "nearfar", handle, None)
            self._stack.callback(glfw.destroy_window, self._handle)
            glfw.make_context_current(self._handle)
            self._context: moderngl.Context = moderngl.create_context(require=330)
        except Exception as error:  # Each platform's OpenGL fails in a way of its own.
            raise DeviceError(
                f"no window could be opened on monitor {self.monitor.name} ({error}): check that "
                f"the display has OpenGL 3.3; on Debian, install libgl1-mesa-dri."
            ) from error
        # A window may be open, and scaled by the desktop all the same.
        displayed = glfw.get_framebuffer_size(self._handle)
        if tuple(displayed) != (size.width, size.height):
            raise DeviceError(
                f"monitor {self.monitor.name} scales its pictures, {displayed[0]} x {displayed[1]} "
                f"pixels to {size.width} x {size.height}: set its scale to 100 %."
            )
        glfw.set_input_mode(self._handle, glfw.CURSOR, glfw.CURSOR_HIDDEN)
        glfw.swap_interval(1)
        glfw.set_key_callback(self._handle, self._on_key)
        glfw.set_monitor_callback(self._on_monitor)
        self._texture = self._context.texture((size.width, size.height), 3, alignment=1)
        self._triangles = moderngl.TRIANGLES
        program = self._context.program(
            vertex_shader=VERTEX_SHADER, fragment_shader=FRAGMENT_SHADER
        )
        self._pixels = self._context.vertex_array(program, [])
        self.period = self._timed(1.0 / self.monitor.refresh)

    def _timed(self, nominal: float) -> float:
        """Time the refreshes: 60 Hz is often 59.94, and a virtual display has none."""
        ends = []
        for _ in range(TIMED_REFRESHES):
            self._glfw.swap_buffers(self._handle)
            self._context.finish()
            ends.append(time.perf_counter())
        measured = float(np.median(np.diff(ends)))
        return measured if abs(measured / nominal - 1) < PERIOD_TOLERANCE else nominal

    def _on_key(self, _window: Any, key: int, _code: int, action: int, _modifiers: int) -> None:
        if key == self._glfw.KEY_ESCAPE and action == self._glfw.PRESS:
            self._stopped = True

    def _on_monitor(self, monitor: Any, event: int) -> None:
        if event == self._glfw.DISCONNECTED:
            name = self._glfw.get_monitor_name(monitor)
            self._gone = self._gone or text_of(name) == self.monitor.name


@contextmanager
def _kept_awake() -> Iterator[None]:
    """Ask the system to leave the screen saver off; where nobody answers, go on."""
    with needed(extra="window", what="a window on the projector"):
        from wakepy import keep
    with keep.presenting(on_fail="pass"):
        yield
