"""Processes that race or are killed: they begin with everything imported, however many they are."""

import sys
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.process import BaseProcess
from multiprocessing.synchronize import Barrier

_FORKS = get_context("forkserver")
_FORKS.set_forkserver_preload(
    [
        "nearfar.cli.acquire",
        "nearfar.cli.application",
        "nearfar.cli.export",
        "nearfar.cli.reconstruct",
        "nearfar.rigs.opening",
        "nearfar.rigs.tables",
        "nearfar.workflow.acquire",
        "nearfar.workflow.export",
        "nearfar.workflow.observers.estimate",
        "nearfar.workflow.observers.quality",
        "nearfar.workflow.reconstruction.reconstruct",
        "tests.killing",
        "tests.processes",
    ]
)


def start(work: Callable[..., object], *arguments: object) -> BaseProcess:
    """Start a function of a module in a process of its own."""
    process = _FORKS.Process(target=work, args=arguments)
    process.start()
    return process


def barrier(processes: int) -> Barrier:
    """Return a barrier for a number of processes."""
    return _FORKS.Barrier(processes)


def run_command(*arguments: object) -> None:
    """Run a command of nearfar's, to its exit status."""
    from nearfar.cli.application import main

    sys.argv = ["nearfar", *map(str, arguments)]
    main()
