"""What may be absent, skipped by name; and a Python in which a package is not there."""

import ctypes
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

PYTORCH_ABSENT = "PyTorch is not installed" if find_spec("torch") is None else ""
NEEDS_PYTORCH = pytest.mark.skipif(bool(PYTORCH_ABSENT), reason=PYTORCH_ABSENT)
# Devices by PyTorch: the processor, and an accelerator where the machine has one. Its driver's own
# file says so at once, where PyTorch takes seconds to be imported.
HAS_ACCELERATOR = Path("/dev/nvidiactl").exists()
PYTORCH_DEVICES = [
    pytest.param(device, marks=NEEDS_PYTORCH)
    for device in (["torch", "cuda"] if HAS_ACCELERATOR else ["torch"])
]


def need_mitsuba() -> None:
    """Skip where Mitsuba cannot be loaded; it is not loaded here, for nearfar names its LLVM."""
    if find_spec("mitsuba") is None:
        pytest.skip("mitsuba is not installed", allow_module_level=True)
    try:
        ctypes.CDLL("libatomic.so.1")
    except OSError:
        pytest.skip(
            "libatomic.so.1, which Mitsuba needs, is not installed (Debian: libatomic1)",
            allow_module_level=True,
        )


def said_without(package: str, program: str) -> str:
    """Run a program where a package cannot be imported; return the `NearfarError` it ends with."""
    lines = "\n".join(f"    {line}" for line in program.splitlines())
    script = (
        f"import sys\nsys.modules[{package!r}] = None\n"
        "from nearfar.errors import MissingPackageError\n"
        f"try:\n{lines}\nexcept MissingPackageError as error:\n    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], check=True, capture_output=True, text=True
    )
    return done.stdout
