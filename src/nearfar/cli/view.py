"""``nearfar view``."""

import math
from contextlib import suppress
from typing import Annotated

import typer

from nearfar.arrays import parse_bytes
from nearfar.cli.options import Browser, Port, Quiet, TransportPath, require_reconstructed
from nearfar.cli.saying import say
from nearfar.progress import progress_bar


def view(
    transport: TransportPath,
    port: Port = 8628,
    host: Annotated[
        str,
        typer.Option(
            help="Address to serve at; beyond this machine the page asks for a token.",
            metavar="ADDRESS",
        ),
    ] = "127.0.0.1",
    memory: Annotated[
        str,
        typer.Option(
            help="Memory for the transport; a larger one is read again whenever the light comes "
            "to rest.",
            metavar="2GB",
        ),
    ] = "2GB",
    browser: Browser = True,
    quiet: Quiet = False,
) -> None:
    """Relight the scene in the browser: drag a light, and see its direct, near and far parts.

    Example: nearfar view transport.zarr
    """
    import webbrowser

    from nearfar.viewer.interactive import InteractiveTransport
    from nearfar.viewer.server import ListeningAddress
    from nearfar.viewer.view import run_view

    available = parse_bytes(memory)
    require_reconstructed(transport)
    with progress_bar("reading", quiet=quiet) as report:
        interactive = InteractiveTransport(
            transport, memory=available, progress=lambda share: report("reading", share)
        )

    _tell_of_memory(interactive.stored.nbytes, available, quiet=quiet)

    def on_start(url: str) -> None:
        say(f"{transport} at {url}, Ctrl-C here ends it")
        if browser:
            webbrowser.open(url)

    # Ctrl-C is how it ends.
    with suppress(KeyboardInterrupt):
        run_view(interactive, ListeningAddress(host, port), on_start)
    say("view ended", quiet=quiet)


def _tell_of_memory(needed: int, available: int, *, quiet: bool) -> None:
    """Say how a transport that is larger than the memory for it is kept there."""
    if needed > available:
        say(
            f"the transport takes {needed / 1e9:.1f} GB and is read again whenever the light comes "
            f"to rest: --memory {math.ceil(needed / 1e9)}GB keeps it in memory",
            quiet=quiet,
        )
