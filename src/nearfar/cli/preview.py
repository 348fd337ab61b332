"""``nearfar preview``."""

from contextlib import suppress

from nearfar.cli.options import Browser, Port, Quiet, RigFile
from nearfar.cli.saying import say
from nearfar.progress import progress_bar


def preview(
    rig: RigFile,
    port: Port = 8627,
    browser: Browser = True,
    quiet: Quiet = False,
) -> None:
    """Show what the camera sees, live: picture, histogram, focus and saturation.

    A simulated RIG.toml shows its scene, to be tried without hardware.

    Example: nearfar preview rig.toml
    """
    import webbrowser

    from nearfar.rigs.opening import open_rig_to_preview
    from nearfar.rigs.tables import read_rig_table
    from nearfar.viewer.preview import run_preview

    table = read_rig_table(rig)

    def started(address: str) -> None:
        say(f"preview at {address}, Esc on the projector or Ctrl-C here ends it")
        if browser:
            webbrowser.open(address)

    # Esc on the projector and Ctrl-C are how a preview ends.
    with progress_bar("opening the rig", quiet=quiet) as report:
        shown = open_rig_to_preview(rig, table, progress=report)
    with shown as opened, suppress(KeyboardInterrupt):
        run_preview(opened, port, started)
    say("preview ended", quiet=quiet)
