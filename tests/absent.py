"""A Python in which a package is not there."""

import subprocess
import sys


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
