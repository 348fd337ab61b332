"""Processes that are to be killed: they begin with everything imported, however many there are."""

import sys
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.process import BaseProcess

_FORKS = get_context("forkserver")
_FORKS.set_forkserver_preload(
    ["nearfar.cli.main", "nearfar.rigs.tables", "nearfar.workflow.acquire", "tests.processes"]
)


def start(work: Callable[..., object], *arguments: object) -> BaseProcess:
    """Start a function of a module in a process of its own."""
    process = _FORKS.Process(target=work, args=arguments)
    process.start()
    return process


def run_command(*arguments: object) -> None:
    """Run a command of nearfar's, to its exit status."""
    from nearfar.cli.main import main

    sys.argv = ["nearfar", *map(str, arguments)]
    main()
