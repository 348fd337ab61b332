"""Pages that are written from the code itself: the command line, and licences of dependencies."""

import html
import re
from importlib.metadata import PackageNotFoundError, metadata, requires
from pathlib import Path
from typing import Any

import typer
from sphinx.application import Sphinx

# Packages whose metadata names no licence: what its text is, or their own pages say.
TOLD_ELSEWHERE = {"embreex": "BSD-2-Clause", "openexr": "BSD-3-Clause"}
GROUPS = {
    "Plan and capture": ["plan", "export", "import", "acquire"],
    "Estimate and judge": ["correspond", "reconstruct", "evaluate", "check", "info", "convert"],
    "Use": [
        "relight",
        "superpose",
        "compensate",
        "bounces",
        "probe",
        "dual",
        "edit",
        "depth",
        "view",
    ],
    "Real rigs": ["devices", "init", "preview", "calibrate"],
    "Scenes and experiments": ["demo", "render", "figures", "compare", "separate"],
}

# Said once for all commands, and left out of their tables.
COMMON_OPTIONS = {
    "--force": "Replace an output that is there already.",
    "-q, --quiet": "Print nothing but errors and warnings.",
}
INTRODUCTION = """\
`nearfar COMMAND --help` prints what stands here. Sizes are height x width. Every command takes
`--help`, and these two unless it says that it goes without:

| option | meaning |
| --- | --- |
| `--force` | Replace an output that is there already. Without it nothing is ever replaced. |
| `-q, --quiet` | Print nothing but errors and warnings. |

The exit status is 0 when all is done, 1 after a fault of a file or a device, which one sentence
names, and 2 after wrong usage."""


def write_command_line(folder: Path) -> None:
    """Write what every command takes into one page, as tables."""
    from nearfar.cli.application import app
    from nearfar.cli.commands import COMMANDS

    grouped = [name for names in GROUPS.values() for name in names]
    if sorted(grouped) != sorted(COMMANDS.own):
        raise ValueError(f"these commands are in no group: {set(COMMANDS.own) ^ set(grouped)}")
    commands: Any = typer.main.get_command(app)
    parts = ["# Command line", INTRODUCTION, ""]
    for title, names in GROUPS.items():
        parts.append(f"## {title}\n")
        for name in names:
            parts += [f"### nearfar {name}\n", *_command(name, commands.commands[name])]
    (folder / "command-line.md").write_text("\n".join(parts), encoding="utf-8")


def _command(name: str, command: Any) -> list[str]:
    """Return the lines of one command: what it does, examples, its arguments and options."""
    context = typer.Context(command, info_name=f"nearfar {name}")
    description, *examples = re.split(r"(?:^|\n\n)(?=[^\n]*: nearfar )", command.help.strip())
    records = [
        (parameter.param_type_name, parameter.get_help_record(context))
        for parameter in command.params
    ]
    arguments = [record for kind, record in records if kind == "argument" and record]
    options = [record for kind, record in records if kind == "option" and record]
    shown = [option for option in options if option not in COMMON_OPTIONS.items()]
    taken = [names.split(" <")[0] for names, _ in arguments]
    usage = " ".join(["nearfar", name, *taken, *(["[OPTIONS]"] if options else [])])
    lines = [description, "", "```text", usage, "```", ""]
    for text in examples:
        label, _, line = text.partition(": nearfar ")
        lines += [f"{label}:", "", "```bash", f"nearfar {' '.join(line.split())}", "```", ""]
    for title, rows in (("argument", arguments), ("option", shown)):
        if rows:
            lines += [f"| {title} | meaning |", "| --- | --- |", *map(_row, rows), ""]
    named = [names for names, _ in options]
    missing = [f"`{option}`" for option in COMMON_OPTIONS if option not in named]
    return [*lines, f"Without {' and '.join(missing)}.", ""] if missing else lines


def _row(record: tuple[str, str]) -> str:
    """Return a row of a table: the names in code, and what they mean."""
    names, _, kind = record[0].partition(" <")
    required = record[1].endswith("[required]")
    meaning = " ".join(record[1].removesuffix("[required]").split())
    meaning = re.sub(r"\[x>=(\d+)\]", r"At least \1.", meaning)
    # An argument is required as it stands; an option is not.
    if required and not kind:
        meaning += " Required."
    text = re.sub(r"(?<![-\w])--[a-z][a-z-]*", r"`\g<0>`", html.escape(meaning, quote=False))
    return "| `{}` | {} |".format(*(part.replace("|", "\\|") for part in (names, text)))


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
