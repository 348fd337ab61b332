"""Output of commands: results on stdout, warnings on stderr."""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from nearfar.arrays import Size, parse_size
from nearfar.cli.flags import with_flags
from nearfar.cli.printable import printable
from nearfar.progress import duration

# A scene that takes less is not announced.
BYTES_TO_ANNOUNCE = 10**9

if TYPE_CHECKING:
    from nearfar.capture import Capture
    from nearfar.transport.verdict import KeptVerdict
    from nearfar.workflow.reconstruction.summary import Summary


def say(text: str, *, quiet: bool = False) -> None:
    """Print text for people on stdout at once, unless they want quiet."""
    if not quiet:
        print(printable(text, keep="\n"), flush=True)


def warn(text: str) -> None:
    """Print a warning on stderr, with options for the Python in it; see `nearfar.cli.flags`."""
    print(f"warning: {printable(with_flags(text))}", file=sys.stderr)


def warn_each(texts: Iterable[str]) -> None:
    """Print warnings on stderr, one after the other."""
    for text in texts:
        warn(text)


def warn_if_wrong(path: Path, verdict: "KeptVerdict | None") -> None:
    """Warn that the transport in a file is not to be relied on, if it was judged wrong."""
    if verdict is not None and verdict.grade == "wrong":
        warn(f"{path} is {verdict}")


def say_memory(
    scene: str, projector: Size | None = None, camera: Size | None = None, *, quiet: bool
) -> None:
    """Print how much memory a scene takes before it is computed or read, if that is much.

    Parameters
    ----------
    scene : str
        Name of a scene, or the path of a RIG.toml that names one; nothing is said of others.
    projector, camera : Size, optional
    quiet : bool
    """
    from nearfar.rigs.tables import SimulatedTable, read_rig_table
    from nearfar.scenes import SCENES
    from nearfar.scenes.cache import scene_memory

    name = scene
    if Path(scene).suffix.lower() == ".toml":
        table = read_rig_table(Path(scene))
        if not isinstance(table, SimulatedTable) or table.scene.name is None:
            return
        name = table.scene.name
        camera = parse_size(table.scene.camera) if table.scene.camera else camera
    if name not in SCENES:
        return
    memory = scene_memory(name, projector, camera)
    if memory.peak < BYTES_TO_ANNOUNCE:
        return
    text = f"the scene {name} takes about {memory.peak / 1e9:.1f} GB of memory"
    if memory.peak > memory.kept:
        text += f" while it is computed, {memory.kept / 1e9:.1f} GB from then on"
    say(text, quiet=quiet)


def say_time(photos: int, seconds: float, *, quiet: bool) -> None:
    """Print before the first photo how long all of them will take."""
    say(f"{photos} photos at {seconds:.2f} s each: about {duration(photos * seconds)}", quiet=quiet)


def say_captured(taken: "Capture", output: Path, *, quiet: bool) -> None:
    """Print what was captured, and warn of saturated photos."""
    from nearfar.faults.of_capture import find_saturation

    for fault in find_saturation(str(output), taken.saturated_share):
        warn(str(fault))
    say(
        f"{len(taken.plan.patterns)} photos of {taken.camera} with {taken.channels} "
        f"channel{'s' if taken.channels > 1 else ''} written to {output}",
        quiet=quiet,
    )


def say_reconstructed(summary: "Summary", capture: "Capture", output: Path, *, quiet: bool) -> None:
    """Print what was reconstructed, and warn of faults of the photos."""
    from nearfar.faults.of_capture import find_faults

    for fault in find_faults(capture, summary.provenance):
        warn(str(fault))
    if summary.provenance["square"]:
        rows, whose = f"{capture.plan.projector} projector pixels", "the projector's"
    else:
        rows, whose = f"{capture.camera} camera pixels", "the camera's"
    say(
        f"transport of {rows} with {capture.channels} channel"
        f"{'s' if capture.channels > 1 else ''}, {summary.lit / summary.pixels:.1%} of {whose} "
        f"directly lit, written to {output}",
        quiet=quiet,
    )
