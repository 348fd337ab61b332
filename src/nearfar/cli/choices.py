"""Options whose values are names: those of a registry, or of a type that lists them."""

from collections.abc import Callable, Collection
from pkgutil import resolve_name
from typing import get_args

import typer
from typer.models import OptionInfo


def choice(names: str | Collection[str], *flags: str, help: str) -> OptionInfo:
    """Return an option that takes one of some names; any other is wrong usage.

    The names are looked up when the command is called or its help is shown, so that the help of
    all commands loads none of them. They follow the registry: help, completion in shells and what
    is refused know what other packages add.

    Parameters
    ----------
    names : str or collection of str
        A reference ``module:object`` to a registry or to a ``Literal``, or the names themselves.
    *flags : str
        As `typer.Option` takes them; by default the parameter's own name.
    help : str

    Returns
    -------
    OptionInfo
        For ``Annotated``, where `typer.Option` would stand.

    Examples
    --------
    >>> from typing import Annotated
    >>> from nearfar.cli.choices import choice
    >>> Offset = Annotated[str, choice("nearfar.plan.paper:Offset", help="How it is taken out.")]
    """
    return _Choice(lambda: _found(names), flags, help)


class _Choice(OptionInfo):
    """An option whose metavar, which help shows, lists names that are found when it is read."""

    def __init__(
        self, names: Callable[[], Collection[str]], flags: Collection[str], help: str
    ) -> None:
        def parse(name: str) -> str:
            if name not in names():
                raise typer.BadParameter(f"{name!r} is not one of {', '.join(names())}.")
            return name

        def complete(start: str) -> list[str]:
            return [name for name in names() if name.startswith(start)]

        self._names = names
        super().__init__(
            default=..., param_decls=tuple(flags), parser=parse, autocompletion=complete, help=help
        )

    @property
    def metavar(self) -> str | None:
        return "|".join(self._names())

    @metavar.setter
    def metavar(self, value: str | None) -> None:
        """Typer's own constructor sets none."""


def _found(names: str | Collection[str]) -> Collection[str]:
    if not isinstance(names, str):
        return names
    found = resolve_name(names)
    return get_args(found) or found
