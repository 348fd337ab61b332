"""Uploaded pictures: decoded in a process of their own, within bounds of memory and time.

A few bytes can claim a picture of any size, and decoders of many formats have had faults: a crash
ends that process and not the server.
"""

import io
import subprocess
import sys
from contextlib import suppress
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import InputError, NearfarError, UnreadableFileError
from nearfar.files.codecs import encode_npy
from nearfar.files.images import decode_picture

MAXIMUM_FILE_BYTES = 2**28
MAXIMUM_PROCESS_BYTES = 3 * 2**30
DECODING_TIMEOUT_SECONDS = 60
MAXIMUM_NAME_CHARACTERS = 80
# Exit statuses of the process.
STATUS_UNREADABLE, STATUS_WRONG_SIZE = 1, 2
ERRORS: dict[int, type[NearfarError]] = {
    STATUS_UNREADABLE: UnreadableFileError,
    STATUS_WRONG_SIZE: InputError,
}


def decode_in_process(data: bytes, name: str, size: Size) -> NDArray[Any]:
    """Decode a picture in a process of its own.

    Parameters
    ----------
    data : bytes
    name : str
        The file's name, for error messages, and for the format of camera raw files; no file of
        this name is opened.
    size : Size
        The size that the picture must have.

    Returns
    -------
    ndarray, shape (y, x) or (y, x, channels)
        In the file's own type.

    Raises
    ------
    InputError
        If the picture has another size.
    UnreadableFileError
        If it is no picture, damaged, or takes too much memory or time.
    """
    base = PurePath(name.replace("\\", "/").replace("\0", "")).name[-MAXIMUM_NAME_CHARACTERS:]
    base = base or "the file"
    # -P keeps modules in the current folder from being imported.
    arguments = [base, str(size.height), str(size.width)]
    command = [sys.executable, "-P", "-m", "nearfar.viewer.decoding", *arguments]
    try:
        done = subprocess.run(
            command,
            input=data,
            capture_output=True,
            timeout=DECODING_TIMEOUT_SECONDS,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise UnreadableFileError(
            f"{base} was not read within {DECODING_TIMEOUT_SECONDS} s: send a smaller file."
        ) from None
    if done.returncode == 0:
        pixels: NDArray[Any] = np.load(io.BytesIO(done.stdout), allow_pickle=False)
        return pixels
    lines = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode in ERRORS and lines:
        raise ERRORS[done.returncode](lines[-1])
    raise UnreadableFileError(f"{base} cannot be decoded: it is damaged, or too large.")


def main(name: str, height: str, width: str) -> int:
    """Decode the picture at standard input, write it as NPY, and return the exit status."""
    # Windows has no limits of this kind.
    with suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MAXIMUM_PROCESS_BYTES, MAXIMUM_PROCESS_BYTES))
    try:
        pixels = decode_picture(sys.stdin.buffer.read(), Path(name))
        size, required = Size(*pixels.shape[:2]), Size(int(height), int(width))
        if size != required:
            print(f"{name} is {size}, and {required} is needed: resize it.", file=sys.stderr)  # noqa: T201
            return STATUS_WRONG_SIZE
        sys.stdout.buffer.write(encode_npy(pixels))
    except NearfarError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return STATUS_UNREADABLE
    except MemoryError:
        print(f"{name} is too large: make it smaller.", file=sys.stderr)  # noqa: T201
        return STATUS_UNREADABLE
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
