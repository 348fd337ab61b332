"""Packages that add something to nearfar by entry points, written as if pip had installed them."""

import shutil
import sys
from collections.abc import Mapping
from pathlib import Path

from nearfar.registry import Registry


def write_package(
    folder: Path,
    package: str,
    module: str,
    group: str,
    entries: Mapping[str, str],
    version: str = "1.0",
) -> None:
    """Write a package of one module into a folder of the path, in place of an earlier version."""
    for old in folder.glob(f"{package}-*.dist-info"):
        shutil.rmtree(old)
    info = folder / f"{package}-{version}.dist-info"
    info.mkdir(parents=True)
    (folder / f"{package}.py").write_text(module)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: {version}\n")
    lines = [f"{name} = {reference}" for name, reference in entries.items()]
    (info / "entry_points.txt").write_text("\n".join([f"[{group}]", *lines, ""]))


def forget_packages(registry: "Registry[object]", *packages: str) -> None:
    """Let a registry, and Python, look for packages again."""
    for package in packages:
        sys.modules.pop(package, None)
    registry.__dict__.pop("_added", None)
    for name in set(registry._loaded) - set(registry.own):
        del registry._loaded[name]
