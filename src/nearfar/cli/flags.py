"""Options of the command line in place of the Python in a message of the library.

A message of the library puts what one writes in Python in backticks: a parameter, as `window`; an
argument, as `offset='inverse'`; or a call, as `acquire(resume=True)`. Here they become options:
``--near``, ``--offset inverse`` and ``acquire --resume``.
"""

import ast
import re
from functools import cache
from inspect import signature
from typing import get_type_hints

from typer.models import OptionInfo

from nearfar.cli.commands import COMMANDS

# Options that have another name than the parameter that they set in the library.
OTHER_NAMES = {"window": "--near", "dropped": "--drop", "numbers": "--reshoot"}
# Calls that are options on the command line; others are the command of their name.
CALLS = {"with_checks": ["--until"], "shoot_again": []}
CODE = re.compile(r"`([^`]+)`")


def with_flags(message: str) -> str:
    """Replace the Python in a message by the options of the command line.

    Code that is no parameter of a command stays, without its backticks.

    Parameters
    ----------
    message : str

    Returns
    -------
    str

    Examples
    --------
    >>> from nearfar.cli.flags import with_flags
    >>> with_flags("make the plan with `offset='inverse'` and `far` at most 3x3.")
    'make the plan with --offset inverse and --far at most 3x3.'
    """
    return CODE.sub(lambda found: in_flags(found[1]) or found[1], message)


def in_flags(code: str) -> str | None:
    """Return the options that stand for some code; None if there are none."""
    for text in (code, f"_({code})"):
        try:
            parsed = ast.parse(text, mode="eval").body
        except SyntaxError:
            continue
        if isinstance(parsed, ast.Name):
            return flags().get(parsed.id)
        if isinstance(parsed, ast.Call) and isinstance(parsed.func, ast.Name):
            return _call(parsed.func.id, parsed.keywords)
    return None


@cache
def flags() -> dict[str, str]:
    """Return the option of each parameter that a command of nearfar's own has."""
    found = {}
    for command in COMMANDS.own:
        hints = get_type_hints(COMMANDS[command], include_extras=True)
        for name in signature(COMMANDS[command]).parameters:
            for option in getattr(hints[name], "__metadata__", ()):
                if isinstance(option, OptionInfo):
                    found[name] = _flag(name, option)
    return found | OTHER_NAMES


def _flag(name: str, option: OptionInfo) -> str:
    """Return the long flag of an option: the one it declares, or its parameter's name."""
    # Typer keeps what comes first in an annotation as the default.
    declared = (option.default, *(option.param_decls or ()))
    long = [flag for flag in declared if isinstance(flag, str) and flag.startswith("--")]
    return long[0].partition("/")[0] if long else f"--{name.replace('_', '-')}"


def _call(function: str, arguments: list[ast.keyword]) -> str | None:
    """Write a call's arguments as options, behind its command or in place of it."""
    words = [] if function == "_" else list(CALLS.get(function, [function]))
    for argument in arguments:
        flag = flags().get(argument.arg or "")
        if flag is None:
            return None
        value = _value(argument.value)
        if value is None:
            return None
        words += [flag] if value is True else [flag, _written(flag, value)]
    return " ".join(words) if words else None


def _value(code: ast.expr) -> object:
    """Return the value of a literal or of a range of literals; None for other code."""
    try:
        if isinstance(code, ast.Call) and ast.unparse(code.func) == "range":
            return range(*map(ast.literal_eval, code.args))
        return ast.literal_eval(code)
    except (ValueError, TypeError):
        return None


def _written(flag: str, value: object) -> str:
    """Write a value as the command line takes it: sizes as HxW, memory in GB, ranges as 2-5."""
    match value:
        case range():
            return f"{value.start}-{value.stop - 1}"
        case (int(height), int(width)):
            return f"{height}x{width}"
        case int() | float() if flag == "--memory":
            return f"{value / 1e9:.1f}GB"
    return str(value)
