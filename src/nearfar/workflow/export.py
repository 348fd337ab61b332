"""Write a plan's patterns as pictures that any player can show."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.files import encode_png, new_output
from nearfar.plan import Plan

PLAN_NAME = "plan.json"


class Shown(NamedTuple):
    """How patterns appear on the frame."""

    frame: Size
    scale: int


def export_patterns(
    plan: Plan,
    folder: Path,
    *,
    scale: int | None = None,
    native: Size | None = None,
    force: bool = False,
    progress: Callable[[int], None] | None = None,
) -> Shown:
    """Write ``pattern-00000.png`` and so on, 8-bit grey, and the plan beside them.

    Parameters
    ----------
    plan : Plan
    folder : Path
        Folder to make.
    scale : int, optional
        Side of a pattern pixel on the frame; 1, or the largest that fits on `native`.
    native : Size, optional
        Frame to centre the pattern on, black around.
    force : bool
        Replace a folder of patterns that is there.
    progress : callable, optional
        Told the number of patterns written.

    Returns
    -------
    Shown

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If the pattern does not fit on `native`.
    NearfarError
        As `nearfar.files.new_output`.
    """
    plan.require_real("export")
    shown = fit_frame(plan.projector, scale, native)
    with new_output(folder, force=force, replaceable=_is_export) as partial:
        partial.mkdir()
        for number in range(len(plan.patterns)):
            frame = draw_frame(plan.draw(number), shown)
            (partial / f"pattern-{number:05d}.png").write_bytes(encode_png(frame))
            if progress is not None:
                progress(number + 1)
        (partial / PLAN_NAME).write_text(plan.to_json(), encoding="utf-8")
    return shown


def fit_frame(projector: Size, scale: int | None, native: Size | None) -> Shown:
    """Return the frame and scale that show a pattern grid; see `export_patterns`.

    Raises
    ------
    InputError
        If the pattern does not fit on `native`.
    """
    if native is None:
        scale = scale or 1
        return Shown(Size(projector.height * scale, projector.width * scale), scale)
    largest = min(native.height // projector.height, native.width // projector.width)
    if largest < (scale or 1):
        raise InputError(
            f"a pattern of {projector} at --scale {scale or 1} does not fit on --native {native}: "
            f"choose a larger frame or a smaller scale."
        )
    return Shown(native, scale or largest)


def draw_frame(pattern: NDArray[np.uint8], shown: Shown) -> NDArray[np.uint8]:
    """Show a pattern on a frame, each pixel as a block, centred, black around."""
    blown = pattern.repeat(shown.scale, axis=0).repeat(shown.scale, axis=1)
    frame = np.zeros(shown.frame, dtype=np.uint8)
    top, left = (
        (outer - inner) // 2 for outer, inner in zip(shown.frame, blown.shape, strict=True)
    )
    frame[top : top + blown.shape[0], left : left + blown.shape[1]] = blown
    return frame


def _is_export(folder: Path) -> bool:
    """Tell whether a folder holds an export and nothing else, or nothing at all."""
    names = [entry.name for entry in folder.iterdir()]
    # Pictures alone may be someone's own.
    return not names or (
        PLAN_NAME in names
        and all(
            name == PLAN_NAME or (name.startswith("pattern-") and name.endswith(".png"))
            for name in names
        )
    )
