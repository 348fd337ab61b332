"""``nearfar calibrate``."""

from nearfar.cli.options import Force, Quiet, RigFile
from nearfar.cli.saying import say, warn
from nearfar.errors import InputError
from nearfar.progress import progress_bar


def calibrate(rig: RigFile, force: Force = False, quiet: Quiet = False) -> None:
    """Measure how a rig's projector and camera turn numbers into light, and back.

    The calibration and its plots are kept in a folder beside the rig, which acquire reads.

    Example: nearfar calibrate rig.toml
    """
    from nearfar.files import check_output
    from nearfar.report.calibration import (
        describe_calibration,
        is_calibration,
        write_calibration,
    )
    from nearfar.rigs.calibration import calibration_folder
    from nearfar.rigs.opening import open_rig_to_calibrate
    from nearfar.rigs.tables import RealTable, read_rig_table
    from nearfar.workflow.calibrate import calibrate as measure

    table = read_rig_table(rig)
    if not isinstance(table, RealTable):
        raise InputError(
            f"{rig} is a simulated rig, whose response is what projector.gamma says: name the "
            f"RIG.toml of a real one."
        )
    folder = calibration_folder(rig)
    check_output(folder, force=force, replaceable=is_calibration)
    with (
        progress_bar("opening the rig", quiet=quiet) as report,
        open_rig_to_calibrate(rig, table, on_alarm=warn) as opened,
    ):
        found = measure(opened, report)
    write_calibration(folder, found, force=force)
    for note in found.notes:
        warn(note)
    say(describe_calibration(found), quiet=quiet)
    say(f"calibration and plots written to {folder}", quiet=quiet)
