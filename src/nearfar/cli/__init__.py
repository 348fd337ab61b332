"""The command line."""

from nearfar.cli.interrupted import SIGINT, end


def main() -> None:
    """Run the command line."""
    try:
        from nearfar.cli.stopping import stopped_at_once
    except KeyboardInterrupt:
        # Until signals are handled, Python raises this wherever it is.
        end(SIGINT)
    with stopped_at_once():
        from nearfar.cli.application import main as run

        run()


__all__ = ["main"]
