"""Commands that are loaded when they are called, by Typer."""

from collections.abc import Iterator, Mapping, MutableMapping
from inspect import getdoc
from typing import TYPE_CHECKING, Any, cast, get_type_hints

import typer
from typer.core import TyperCommand, TyperGroup
from typer.models import ParameterInfo

from nearfar.cli.commands import COMMANDS
from nearfar.cli.faults import faults_in_sentences, stopped_cleanly
from nearfar.errors import ExtensionError

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import FunctionType

# Room that Typer leaves between the columns of a list, and around them.
MARGIN_COLUMNS = 6


class CommandGroup(TyperGroup):
    """The commands of `COMMANDS`: each is loaded and built when it is called.

    A command of another package that cannot be loaded is listed with what is wrong with it, and
    ends in that sentence when it is called; the others are as they were.
    """

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        # Typer looks up here what is called, and what a misspelt name may have meant.
        self.commands = cast("MutableMapping[str, Any]", _BuiltCommands())

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of all commands, in order."""
        return list(COMMANDS)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the list of commands, from their docstrings alone."""
        names = list(COMMANDS)
        limit = formatter.width - MARGIN_COLUMNS - max(map(len, names))
        with formatter.section("Commands"):
            formatter.write_dl(
                [
                    (name, TyperCommand(name, help=_help_of(name)).get_short_help_str(limit))
                    for name in names
                ]
            )


class _BuiltCommands(Mapping[str, Any]):
    """Typer's commands by name, each built when it is asked for."""

    def __getitem__(self, name: str) -> Any:
        if name not in COMMANDS:
            raise KeyError(name)
        try:
            return _built(name, COMMANDS[name])
        except ExtensionError as fault:
            return _broken(name, fault)

    def __iter__(self) -> Iterator[str]:
        return iter(COMMANDS)

    def __len__(self) -> int:
        return len(COMMANDS)


def _help_of(name: str) -> str:
    try:
        return getdoc(COMMANDS[name]) or ""
    except ExtensionError as fault:
        return str(fault)


def _built(name: str, function: "FunctionType") -> Any:
    """Build Typer's command from a function.

    Raises
    ------
    ExtensionError
        If Typer cannot read the signature of another package's function.
    """
    try:
        _leave_files_to(function)
        # Inside the command, before the parser gives interrupts and faults words of its own.
        return _by_typer(name, stopped_cleanly()(faults_in_sentences()(function)))
    except Exception as error:
        if name in COMMANDS.own:
            raise
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise ExtensionError(
            f"the command {name!r} of the module {function.__module__} cannot be used ({reason}): "
            f"update or uninstall that package."
        ) from error


def _leave_files_to(function: "FunctionType") -> None:
    """Let a command itself say that it may not read a file; to Typer that is wrong usage."""
    for hint in get_type_hints(function, include_extras=True).values():
        for information in getattr(hint, "__metadata__", ()):
            if isinstance(information, ParameterInfo):
                information.readable = False


def _broken(name: str, fault: ExtensionError) -> Any:
    """Build a command that takes anything, and ends in what is wrong with it."""

    @faults_in_sentences()
    def fail() -> None:
        raise fault

    fail.__doc__ = str(fault)
    anything = {"ignore_unknown_options": True, "allow_extra_args": True}
    return _by_typer(name, fail, context_settings=anything)


def _by_typer(name: str, function: "Callable[..., Any]", **settings: Any) -> Any:
    alone = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
    alone.command(name, **settings)(function)
    return typer.main.get_command(alone)
