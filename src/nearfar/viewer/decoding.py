"""Pictures that a page sends: decoded in a process of their own, within bounds.

A few bytes can claim a picture of any size, and decoders of many formats have had faults: what
goes wrong there ends that process and not the server.
"""

import io
import resource
import subprocess
import sys
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import InputError, NearfarError, UnreadableFileError
from nearfar.files.codecs import encode_npy
from nearfar.files.images import decode_picture

# Bytes of a file, and of the process that decodes it.
LARGEST = 2**28
MEMORY = 4 * 2**30
# Seconds that it may take.
PATIENCE = 60


def decode_apart(data: bytes, name: str) -> NDArray[Any]:
    """Decode a picture in a process of its own.

    Parameters
    ----------
    data : bytes
    name : str
        Of the file, for the message and, of camera raw files, for the kind; never opened.

    Raises
    ------
    UnreadableFileError
        If it is no picture, damaged, or takes too much memory or time.
    """
    shown = PurePath(name.replace("\\", "/")).name[-80:] or "the file"
    command = [sys.executable, "-m", "nearfar.viewer.decoding", shown]
    try:
        done = subprocess.run(
            command, input=data, capture_output=True, timeout=PATIENCE, check=False
        )
    except (subprocess.TimeoutExpired, ValueError, OSError) as error:
        raise UnreadableFileError(f"{shown} could not be read in time ({error}).") from None
    if done.returncode == 0:
        pixels: NDArray[Any] = np.load(io.BytesIO(done.stdout), allow_pickle=False)
        return pixels
    told = done.stderr.decode(errors="replace").strip().splitlines()
    if done.returncode == 1 and told:
        raise UnreadableFileError(told[-1])
    raise UnreadableFileError(f"{shown} cannot be decoded: it is damaged, or too large.")


def main(name: str) -> int:
    """Decode standard input, and write it as an array to standard output."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    try:
        pixels = decode_picture(sys.stdin.buffer.read(), Path(name))
        sys.stdout.buffer.write(encode_npy(pixels))
    except NearfarError as error:
        print(error, file=sys.stderr)  # noqa: T201
        return 1
    except MemoryError:
        print(InputError(f"{name} is too large: make it smaller."), file=sys.stderr)  # noqa: T201
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
