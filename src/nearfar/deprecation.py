"""Old ways to call public functions, which keep working for one release with a warning."""

import os
import warnings
from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, ParamSpec, TypeVar, cast

Parameters = ParamSpec("Parameters")
Returned = TypeVar("Returned")


def warn_of(old: str, new: str, *, stacklevel: int = 3) -> None:
    """Warn that an old way to do something goes away, and name the new one.

    Parameters
    ----------
    old, new : str
        Subject and cure of the message.
    stacklevel : int
        As `warnings.warn` takes it; 3 is the caller of the function that calls this one.
    """
    warnings.warn(
        f"{old} will be removed in the next release: {new}.",
        DeprecationWarning,
        stacklevel=stacklevel,
    )


def path_after_content(
    function: Callable[Parameters, Returned],
) -> Callable[Parameters, Returned]:
    """Accept the old order of arguments, the path before what is written there, with a warning."""
    content = next(iter(signature(function).parameters))

    @wraps(function)
    def in_either_order(*arguments: Parameters.args, **options: Parameters.kwargs) -> Returned:
        given: tuple[Any, ...] = arguments
        is_old = len(given) > 1 or content in options
        if given and is_old and isinstance(given[0], str | os.PathLike):
            warn_of(
                f"{function.__name__} with the path as its first argument",
                "give the path as the second",
            )
            first = (options.pop(content),) if content in options else given[1:2]
            rest = given[1:] if len(first) and len(given) == 1 else given[2:]
            given = (*first, given[0], *rest)
        return cast("Callable[..., Returned]", function)(*given, **options)

    return in_either_order
