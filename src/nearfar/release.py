"""The version of nearfar that is installed."""

from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed_version


def version() -> str:
    """Return the installed version, or "unknown" where nearfar runs without being installed."""
    try:
        return installed_version("nearfar")
    except PackageNotFoundError:
        return "unknown"
