"""Write a plan's patterns as pictures that any player can show."""

from pathlib import Path

from nearfar.arrays import Size
from nearfar.files import encode_png, new_output
from nearfar.illumination.frames import FrameLayout, draw_frame, fit_frame
from nearfar.plan import Plan
from nearfar.progress import Report, ignore_progress

PLAN_NAME = "plan.json"


def export_patterns(
    plan: Plan,
    folder: Path,
    *,
    scale: int | None = None,
    native: Size | None = None,
    force: bool = False,
    progress: Report = ignore_progress,
) -> FrameLayout:
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
        Called with "patterns" and the share of them that is written, 0 to 1, after each.

    Returns
    -------
    FrameLayout

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
    layout = fit_frame(plan.projector, scale, native)
    with new_output(folder, force=force, replaceable=_is_export) as partial:
        partial.mkdir()
        for number in range(len(plan.patterns)):
            frame = draw_frame(plan.draw(number), layout)
            (partial / f"pattern-{number:05d}.png").write_bytes(encode_png(frame))
            progress("patterns", (number + 1) / len(plan.patterns))
        (partial / PLAN_NAME).write_text(plan.to_json(), encoding="utf-8")
    return layout


def _is_export(folder: Path) -> bool:
    """Return whether a folder is empty, or holds an export and nothing else."""
    names = [entry.name for entry in folder.iterdir()]
    # Pictures alone may be someone's own.
    return not names or (
        PLAN_NAME in names
        and all(
            name == PLAN_NAME or (name.startswith("pattern-") and name.endswith(".png"))
            for name in names
        )
    )
