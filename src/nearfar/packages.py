"""Packages that only some parts need."""

from collections.abc import Iterator
from contextlib import contextmanager

from nearfar.errors import MissingPackageError


@contextmanager
def needed(*, extra: str, what: str) -> Iterator[None]:
    """Say, where an import within fails, what needs the package and how to get it.

    Parameters
    ----------
    extra : str
        The extra of nearfar that brings the package.
    what : str
        What cannot be done without.

    Raises
    ------
    MissingPackageError
    """
    try:
        yield
    except ImportError as error:
        raise MissingPackageError(
            f"{what} needs a package that cannot be loaded ({error}): install it by pip install "
            f"'nearfar[{extra}]'."
        ) from None
