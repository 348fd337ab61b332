"""What the system says of files that cannot be read, in sentences."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from nearfar.errors import MissingFileError, NearfarError, UnreadableFileError


@contextmanager
def reading_faults(path: Path) -> Iterator[None]:
    """Turn the system's faults while a file is read into a sentence with the reason.

    Faults that nearfar put into a sentence already pass.

    Raises
    ------
    MissingFileError, UnreadableFileError
    """
    try:
        yield
    except NearfarError:
        raise
    except FileNotFoundError:
        raise MissingFileError(f"{path} is not there: check the name.") from None
    except OSError as error:
        raise UnreadableFileError(
            f"{path} cannot be read ({error.strerror}): check that it is a file you may read."
        ) from error


@contextmanager
def forbidden_folders(path: Path) -> Iterator[None]:
    """Turn what may not be read in a folder into a sentence about the folder.

    Raises
    ------
    UnreadableFileError
    """
    try:
        yield
    except PermissionError as error:
        raise UnreadableFileError(
            f"{path} cannot be read ({error.strerror}): check its permissions."
        ) from error
