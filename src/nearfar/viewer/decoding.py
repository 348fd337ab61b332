"""Pictures that a page sends: decoded in a process of their own, within bounds.

A few bytes can claim a picture of any size, and decoders of many formats have had faults: what
goes wrong there ends that process and not the server.
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

# Bytes of a file, and of the process that decodes it.
LARGEST = 2**28
MEMORY = 3 * 2**30
# Seconds that it may take.
PATIENCE = 60
# By exit status.
FAULTS: dict[int, type[NearfarError]] = {1: UnreadableFileError, 2: InputError}


def decode_apart(data: bytes, name: str, size: Size) -> NDArray[Any]:
    """Decode a picture in a process of its own.

    Parameters
    ----------
    data : bytes
    name : str
        Of the file, for the message and, of camera raw files, for the kind; never opened.
    size : Size
        That the picture must have.

    Raises
    ------
    InputError
        If it is of another size.
    UnreadableFileError
        If it is no picture, damaged, or takes too much memory or time.
    """
    shown = PurePath(name.replace("\\", "/").replace("\0", "")).name[-80:] or "the file"
    # -P: what lies in the current folder is not to be imported.
    words = [shown, str(size.height), str(size.width)]
    command = [sys.executable, "-P", "-m", "nearfar.viewer.decoding", *words]
    try:
        done = subprocess.run(
            command, input=data, capture_output=True, timeout=PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        raise UnreadableFileError(
            f"{shown} was not read within {PATIENCE} s: send a smaller file."
        ) from None
    if done.returncode == 0:
        pixels: NDArray[Any] = np.load(io.BytesIO(done.stdout), allow_pickle=False)
        return pixels
    told = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode in FAULTS and told:
        raise FAULTS[done.returncode](told[-1])
    raise UnreadableFileError(f"{shown} cannot be decoded: it is damaged, or too large.")


def main(name: str, height: str, width: str) -> int:
    """Decode standard input, and write it as an array to standard output."""
    # Not everywhere: the rest works without.
    with suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        pixels = decode_picture(sys.stdin.buffer.read(), Path(name))
        found, wanted = Size(*pixels.shape[:2]), Size(int(height), int(width))
        if found != wanted:
            print(f"{name} is {found}, and {wanted} is needed: resize it.", file=sys.stderr)  # noqa: T201
            return 2
        sys.stdout.buffer.write(encode_npy(pixels))
    except NearfarError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 1
    except MemoryError:
        print(f"{name} is too large: make it smaller.", file=sys.stderr)  # noqa: T201
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
