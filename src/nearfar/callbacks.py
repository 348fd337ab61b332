"""Callbacks that report progress; `nearfar.progress` draws them."""

from collections.abc import Callable
from inspect import signature
from typing import Any, cast

from nearfar.deprecation import warn_of
from nearfar.errors import InputError

# The type of `progress` of every function that takes long. It is called with the step and the share
# of the step that is done, 0 to 1.
Report = Callable[[str, float], None]
# The deprecated type of `progress`: called with a count or a share alone.
OldReport = Callable[[Any], None]


def counting(report: Report, what: str, total: int) -> Callable[[int], None]:
    """Return a function that takes a count and reports its share of `total`."""
    return lambda done: report(what, done / max(1, total))


def counted(report: Report, what: str, total: int) -> Callable[..., None]:
    """Return a callback that takes a count and reports the share done.

    .. deprecated:: 0.1
        Give `report` itself as `progress`.

    Parameters
    ----------
    report : callable
        Takes the step and the share of it that is done.
    what : str
        The step.
    total : int
        The count at which the step is done.

    Returns
    -------
    callable
        Takes a count, or a step and its share.
    """

    def report_either(*done: Any) -> None:
        report(*(done if len(done) == 2 else (what, done[0] / max(1, total))))

    return report_either


def as_report(
    progress: Report | OldReport | None, total: float = 1.0, *, stacklevel: int = 4
) -> Report:
    """Return a callback of a step and a share from either type of callback.

    Parameters
    ----------
    progress : callable, optional
        A callback of a step and a share; or, with a warning, the deprecated one of one argument.
    total : float
        What a callback of one argument is called with at the end: a count as an int, or a share as
        a float.
    stacklevel : int
        As `warnings.warn` takes it; 4 is the caller of the function that calls this one.
    """
    if progress is None:
        return ignore_progress
    if not callable(progress):
        raise InputError(
            f"progress is a {type(progress).__name__}, not a function: give one that takes a "
            f"step and the share done, such as nearfar.progress_bar yields."
        )
    try:
        signature(progress).bind("", 0.0)
    except TypeError:
        warn_of(
            "a progress callback of one argument",
            "take what is being done, a str, and the share of it that is done, a float",
            stacklevel=stacklevel,
        )
        of_one = cast("OldReport", progress)
        if isinstance(total, int):
            return lambda _what, share: of_one(round(share * total))
        return lambda _what, share: of_one(share * total)
    except ValueError:
        # A built-in function without a signature.
        pass
    return cast("Report", progress)


def ignore_progress(_what: str, _share: float) -> None:
    """Draw nothing: for functions that were given no `progress`."""
