"""``nearfar compensate --refine``: a light that photos of it correct."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from nearfar.cli.opening import check_rig
from nearfar.cli.saying import say_memory, warn
from nearfar.errors import DeviceError, KeptInterrupt
from nearfar.progress import progress_bar

if TYPE_CHECKING:
    from nearfar.applications.compensate import Compensation
    from nearfar.transport.model import Transport
    from nearfar.transport.stored import StoredTransport
    from nearfar.workflow.refine import Refinement

MOST = 3


def check_refinement(refine: int | None, rig: str | None) -> None:
    """Refuse --refine without --rig, --rig without --refine, and a rig that is not there.

    Before a light is computed, which takes a while.
    """
    if (refine is None) != (rig is None):
        raise typer.BadParameter(
            "goes with --rig only." if rig is None else "is for --refine.",
            param_hint="--refine" if rig is None else "--rig",
        )
    if rig is not None:
        check_rig(rig)


def check_simulated_rig(rig: str, opened: "StoredTransport") -> None:
    """Refuse a simulated rig whose photos are not those of a transport, before a light is computed.

    Real devices are opened once, when there is a light to show.
    """
    from nearfar.rigs.opening import open_rig
    from nearfar.rigs.simulated.rig import SimulatedRig
    from nearfar.rigs.tables import RealTable, read_rig_table
    from nearfar.workflow.refine import require_photos_of

    path = Path(rig)
    if path.suffix.lower() == ".toml" and isinstance(read_rig_table(path), RealTable):
        return
    with open_rig(rig, opened.projector) as simulated:
        if isinstance(simulated, SimulatedRig):
            require_photos_of(opened, simulated)


def refined(
    transport: "Transport",
    found: "Compensation",
    rig: str,
    corrections: int,
    *,
    output: Path,
    force: bool,
    quiet: bool,
) -> "Refinement":
    """Correct a light by photos of it, and write the best one.

    What a stopped rig or user leaves is the best light so far.
    """
    from nearfar.files import write_light
    from nearfar.rigs.opening import open_rig
    from nearfar.workflow.refine import refinements

    about = transport.provenance.get("rig")
    exposure = about.get("exposure") if isinstance(about, dict) else None
    say_memory(rig, transport.projector, quiet=quiet)
    best: Refinement | None = None
    try:
        with (
            progress_bar("opening the rig", quiet=quiet) as report,
            open_rig(
                rig, transport.projector, exposure=exposure, progress=report, on_alarm=warn
            ) as opened,
        ):
            for note in opened.notes:
                warn(note)
            for best in refinements(transport, found, opened, corrections):
                report("photos", len(best.errors) / (corrections + 1))
    except (DeviceError, KeyboardInterrupt) as stopped:
        write_light(output, found.light if best is None else best.light, force=force)
        taken = 0 if best is None else len(best.errors)
        kept = f"the best light of {taken} photos" if taken else "the light without a photo of it"
        if isinstance(stopped, DeviceError):
            told = str(stopped).removesuffix(".")
            raise type(stopped)(f"{told}; {kept} is kept in {output}.") from stopped
        raise KeptInterrupt(f"interrupted; {kept} is kept in {output}.") from stopped
    assert best is not None
    write_light(output, best.light, force=force)
    return best
