"""The command line."""

from nearfar.cli.stopping import stopped_at_once


def main() -> None:
    """Run the command line."""
    with stopped_at_once():
        from nearfar.cli.application import main as run

        run()


__all__ = ["main"]
