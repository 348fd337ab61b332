"""Pages that are written from the code itself: the command line, and licences of dependencies."""

import re
import subprocess
import sys
from importlib.metadata import PackageNotFoundError, metadata, requires
from pathlib import Path

from sphinx.application import Sphinx

# Packages whose metadata names no licence: what its text is, or their own pages say.
TOLD_ELSEWHERE = {"embreex": "BSD-2-Clause", "openexr": "BSD-3-Clause"}
GROUPS = {
    "Plan and capture": ["plan", "export", "import", "acquire"],
    "Estimate and judge": ["correspond", "reconstruct", "evaluate", "check", "info", "convert"],
    "Use": ["relight", "compensate", "bounces", "probe", "dual", "depth", "view"],
    "Real rigs": ["devices", "init", "preview", "calibrate"],
    "Scenes and experiments": ["demo", "render", "figures", "compare", "separate"],
}


def write_command_line(folder: Path) -> None:
    """Write the help of every command into one page."""
    from nearfar.cli.commands import COMMANDS

    grouped = [name for names in GROUPS.values() for name in names]
    if sorted(grouped) != sorted(COMMANDS.own):
        raise ValueError(f"these commands are in no group: {set(COMMANDS.own) ^ set(grouped)}")
    parts = ["# Command line", "Sizes are height x width; every command has `--help`.", ""]
    for title, names in GROUPS.items():
        parts.append(f"## {title}\n")
        for name in names:
            done = subprocess.run(
                [Path(sys.executable).parent / "nearfar", name, "--help"],
                capture_output=True, text=True, check=True, env={"COLUMNS": "88", "PATH": ""},
            )  # fmt: skip
            parts += [f"### nearfar {name}\n", "```text", done.stdout.strip(), "```", ""]
    (folder / "command-line.md").write_text("\n".join(parts), encoding="utf-8")


def licence_of(package: str) -> str:
    """Return a package's licence in a few words, as its own metadata tells it."""
    if package.lower() in TOLD_ELSEWHERE:
        return TOLD_ELSEWHERE[package.lower()]
    about = metadata(package)
    if "License-Expression" in about:
        return about["License-Expression"]
    classified = [
        entry.split(" :: ")[-1]
        for entry in about.get_all("Classifier") or []
        if entry.startswith("License ::") and not entry.endswith("OSI Approved")
    ]
    first = about.get("License", "").strip().splitlines()
    return ", ".join(classified) or (first[0][:60] if first else "not told")


def dependencies() -> dict[str, list[str]]:
    """Return what nearfar needs by the extra that brings it, the core's under the empty name."""
    found: dict[str, list[str]] = {}
    for line in requires("nearfar") or []:
        name = re.split(r"[^A-Za-z0-9._-]", line, maxsplit=1)[0]
        extra = re.search(r"extra == ['\"](\w+)['\"]", line)
        found.setdefault(extra[1] if extra else "", []).append(name)
    return found


def write_licences(folder: Path) -> None:
    """Write which packages are needed, and their licences."""
    parts = [
        "# Licences of dependencies",
        "nearfar itself is under the MIT licence. What it needs, as installed when these pages "
        "were built; the core holds nothing under the GPL or AGPL.",
        "",
    ]
    for extra, names in dependencies().items():
        parts += [f"## {'Core' if not extra else f'Extra `{extra}`'}\n"]
        parts += ["| package | version | licence |", "| --- | --- | --- |"]
        for name in sorted(names, key=str.lower):
            try:
                row = (name, metadata(name)["Version"], licence_of(name))
            except PackageNotFoundError:
                row = (name, "not installed here", "see its own page")
            parts.append("| " + " | ".join(row) + " |")
        parts.append("")
    (folder / "licences.md").write_text("\n".join(parts), encoding="utf-8")


def _write(app: Sphinx) -> None:
    folder = Path(app.srcdir) / "reference"
    folder.mkdir(exist_ok=True)
    write_command_line(folder)
    write_licences(folder)


def setup(app: Sphinx) -> dict[str, bool]:
    """Write the pages before Sphinx reads any."""
    app.connect("builder-inited", _write)
    return {"parallel_read_safe": True}
