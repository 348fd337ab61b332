"""Projectors before one camera, as one projector with their pattern grids side by side.

A plan of `nearfar.plan.sharing.shared_plan` is photographed by such a rig as by any other.
"""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.illumination.frames import FrameLayout, fit_frame
from nearfar.progress import Report
from nearfar.rigs.calibration import Calibration, calibration_folder, read_calibration
from nearfar.rigs.cameras.base import Camera
from nearfar.rigs.linear import LinearProjector, identity
from nearfar.rigs.monitors import Monitor
from nearfar.rigs.opening import exposure_of, open_rig
from nearfar.rigs.real.rig import RealRig
from nearfar.rigs.screens import Screen, Window
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.rigs.simulated.side_by_side import simulated_side_by_side
from nearfar.rigs.tables import RealTable, ScreenTable, read_rig_table


class SideBySideScreen:
    """Screens of several projectors as one: each displays its part of a frame, black around.

    Parameters
    ----------
    screens : sequence of Screen
    part : Size
        Of a frame's part for each.
    """

    def __init__(self, screens: Sequence[Screen], part: Size) -> None:
        self._screens, self._part = screens, part
        first = screens[0].monitor
        self.monitor = Monitor(
            first.index,
            " and ".join(screen.monitor.name for screen in screens),
            Size(part.height, part.width * len(screens)),
            first.place,
            min(screen.monitor.refresh for screen in screens),
        )
        self.period = max(screen.period for screen in screens)

    def show(self, frame: NDArray[np.uint8]) -> None:
        """Show a frame, (height, width, 3), and return once it is on the way to all projectors."""
        for screen, part in zip(
            self._screens, np.split(frame, len(self._screens), axis=1), strict=True
        ):
            whole = np.zeros((*screen.monitor.size, 3), dtype=np.uint8)
            top, left = (
                (outer - inner) // 2
                for outer, inner in zip(screen.monitor.size, self._part, strict=True)
            )
            whole[top : top + self._part.height, left : left + self._part.width] = part
            screen.show(whole)

    def close(self) -> None:
        """Give the monitors back."""
        with ExitStack() as stack:
            for screen in self._screens:
                stack.callback(screen.close)

    def wait(self, seconds: float) -> None:
        """Let time pass; the user may stop it by Esc on any of the screens.

        Raises
        ------
        KeyboardInterrupt
            If Esc was pressed.
        """
        first, *others = self._screens
        first.wait(seconds)
        for screen in others:
            screen.wait(0.0)


class SideBySideRig(RealRig):
    """A real rig of several projectors, which tells of each what a capture remembers.

    Parameters
    ----------
    calibrations : sequence of Calibration or None
        Of each; the camera's levels are those of the first.
    **settings
        As `RealRig` takes them.
    """

    def __init__(self, calibrations: Sequence[Calibration | None], **settings: Any) -> None:
        super().__init__(calibration=calibrations[0], **settings)
        self._calibrations = calibrations

    def describe(self) -> dict[str, Any]:
        """Return the settings of the rig, and those of each projector under "projectors"."""
        common = super().describe()
        each = [
            {
                **common,
                "calibration": calibration.made if calibration else None,
                "colour_mixing": [list(row) for row in calibration.mixing] if calibration else None,
            }
            for calibration in self._calibrations
        ]
        return {**common, "projectors": each}


def open_side_by_side(
    rigs: Sequence[str],
    projector: Size,
    *,
    exposure: float | None = None,
    progress: Report | None = None,
    on_alarm: Callable[[str], None] | None = None,
    on_start: Callable[[float], None] | None = None,
) -> SimulatedRig | RealRig:
    """Open the rigs of several projectors before one camera as one rig.

    Parameters
    ----------
    rigs : sequence of str
        As `nearfar.open_rig` takes them; a RIG.toml for each projector, with the same [camera].
    projector : Size
        Pattern grid of each.
    exposure, progress, on_alarm, on_start
        As `nearfar.open_rig`.

    Returns
    -------
    SimulatedRig or RealRig
        Of a pattern grid as wide as all together.

    Raises
    ------
    InputError
        If they are not before one camera.
    NearfarError
        As `nearfar.open_rig`.
    """
    tables = [read_rig_table(Path(rig)) if rig.lower().endswith(".toml") else None for rig in rigs]
    real = [table for table in tables if isinstance(table, RealTable)]
    if not real:
        opened = [open_rig(rig, projector, progress=progress) for rig in rigs]
        return simulated_side_by_side(
            [rig for rig in opened if isinstance(rig, SimulatedRig)], rigs
        )
    if len(real) < len(rigs) or any(table.camera != real[0].camera for table in real):
        raise InputError(
            f"{' and '.join(rigs)} are not of one camera, and photos of one are shared: write the "
            f"same [camera] in all of them, or photograph by one projector after the other."
        )
    return _open_real([Path(rig) for rig in rigs], real, projector, (exposure, on_alarm, on_start))


def _open_real(
    paths: Sequence[Path],
    tables: Sequence[RealTable],
    projector: Size,
    settings: tuple[float | None, Callable[[str], None] | None, Callable[[float], None] | None],
) -> RealRig:
    """Open a window for each projector, and the camera; give them back if anything fails."""
    exposure, on_alarm, on_start = settings
    calibrations = [read_calibration(calibration_folder(path)) for path in paths]
    if len(tables[0].camera.bracket) > 1:
        raise InputError(
            f"{paths[0]} asks for a bracket, and shared photos are of one exposure: remove bracket."
        )
    with ExitStack() as stack:
        camera = stack.enter_context(tables[0].camera.open(paths[0].parent))
        screens = [stack.enter_context(Window(table.projector.monitor)) for table in tables]
        rig = side_by_side_rig(
            screens,
            camera,
            projector,
            [table.projector for table in tables],
            calibrations,
            exposure=exposure_of(tables[0]) if exposure is None else exposure,
            on_alarm=on_alarm,
            on_start=on_start,
        )
        # The rig closes them from here on.
        stack.pop_all()
    return rig


def side_by_side_rig(
    screens: Sequence[Screen],
    camera: Camera,
    projector: Size,
    tables: Sequence[ScreenTable],
    calibrations: Sequence[Calibration | None],
    *,
    exposure: float | None = None,
    on_alarm: Callable[[str], None] | None = None,
    on_start: Callable[[float], None] | None = None,
) -> RealRig:
    """Set up a rig of screens, each drawn by the response of its own projector.

    Parameters
    ----------
    screens : sequence of Screen
    camera : Camera
    projector : Size
        Pattern grid of each.
    tables : sequence of ScreenTable
        [projector] of each.
    calibrations : sequence of Calibration or None
        Of each; the camera's levels are those of the first.
    exposure, on_alarm, on_start
        As `RealRig`.

    Raises
    ------
    InputError
        If a pattern grid does not fit on its screen, or as `RealRig`.
    """
    scale = min(
        fit_frame(projector, table.scale, screen.monitor.size).scale
        for screen, table in zip(screens, tables, strict=True)
    )
    part = Size(projector.height * scale, projector.width * scale)
    layout = FrameLayout(part, scale)
    each = [
        LinearProjector(
            calibration.response_table() if calibration else identity(), layout, table.brightness
        )
        for calibration, table in zip(calibrations, tables, strict=True)
    ]

    def draw(pattern: NDArray[np.uint8]) -> NDArray[np.uint8]:
        parts = np.split(pattern, len(each), axis=1)
        return np.hstack([one.draw(own) for one, own in zip(each, parts, strict=True)])

    return SideBySideRig(
        calibrations,
        screen=SideBySideScreen(screens, part),
        camera=camera,
        projector=Size(projector.height, projector.width * len(screens)),
        scale=scale,
        settle=max(table.settle for table in tables),
        exposure=exposure,
        draw=draw,
        on_alarm=on_alarm,
        on_start=on_start,
    )
