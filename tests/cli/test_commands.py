"""The registry of commands: nearfar's own, those of other packages, and values that are names."""

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from nearfar.cli.commands import COMMANDS
from tests.cli.conftest import check_done, run_nearfar
from tests.packages import write_package

LONGEST_BODY = 60
MODULE = '''
from typing import Annotated
import typer
from nearfar.cli.choices import choice
from nearfar.errors import InputError

def greet(
    name: str,
    colour: Annotated[str, choice(("red", "blue"), help="Of the letters.")] = "red",
) -> None:
    """Greet somebody.

    Example: nearfar greet Ada
    """
    if name == "nobody":
        raise InputError(f"{name} cannot be greeted: name somebody.")
    print("hello", name, "in", colour)

def puzzle(what: "NoSuchType") -> None:
    """Take what the command line cannot read."""

NUMBER = 3
'''
ENTRIES = {
    "greet": "added_commands:greet",
    "gone": "added_commands:gone",
    "puzzle": "added_commands:puzzle",
    "number": "added_commands:NUMBER",
}


@pytest.fixture(scope="module")
def added(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a package that adds commands, one of which works."""
    folder = tmp_path_factory.mktemp("site")
    write_package(folder, "added_commands", MODULE, "nearfar.commands", ENTRIES)
    return folder


def _run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join(filter(None, [str(folder), os.environ.get("PYTHONPATH")]))
    return subprocess.run(
        [sys.executable, "-m", "nearfar", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path, "COLUMNS": "100"},
    )


def test_a_command_of_another_package_works_as_nearfars_own(added: Path):
    ran = _run(added, "greet", "Ada", "--colour", "blue")
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "hello Ada in blue\n", "")
    ran = _run(added, "greet", "nobody")
    assert (ran.returncode, ran.stdout) == (1, "")
    assert ran.stderr == "nearfar: nobody cannot be greeted: name somebody.\n"
    assert _run(added, "greet", "Ada", "--colour", "green").returncode == 2
    shown = _run(added, "greet", "--help").stdout
    assert "Greet somebody." in shown
    assert "red|blue" in shown


@pytest.mark.parametrize("name", ["gone", "puzzle", "number"])
def test_a_command_that_cannot_be_used_ends_in_a_sentence(added: Path, name: str):
    ran = _run(added, name, "x", "--y", "3")
    assert (ran.returncode, ran.stdout) == (1, "")
    assert ran.stderr.startswith(f"nearfar: the command {name!r} of ")
    assert ran.stderr.endswith("update or uninstall that package.\n")
    assert ran.stderr.count("\n") == 1
    shown = _run(added, name, "--help")
    assert shown.returncode == 0
    assert "update or uninstall that package" in " ".join(shown.stdout.split())


def test_the_help_lists_added_commands_and_keeps_the_own(added: Path):
    ran = _run(added, "--help")
    assert ran.returncode == 0
    for name in (*COMMANDS.own, "greet", "gone", "puzzle", "number"):
        assert ran.stdout.count(f"\n  {name} ") == 1
    assert "Greet somebody." in ran.stdout
    assert ran.stderr == ""


def test_a_command_of_a_name_that_is_taken_is_left_out_with_a_warning(tmp_path: Path):
    taken = {"plan": "added_commands:greet"}
    write_package(tmp_path, "added_commands", MODULE, "nearfar.commands", taken)
    ran = _run(tmp_path, "--help")
    assert ran.returncode == 0
    assert ran.stderr == (
        "warning: the package added_commands adds a command 'plan', a name that nearfar already "
        "has: it is left out; rename it, or uninstall the package added_commands.\n"
    )
    plan = _run(tmp_path, "plan", "--projector", "16x20", "--near", "5", "--far", "3x3", "-q")
    assert (plan.returncode, plan.stdout, plan.stderr) == (0, "", "")


def test_a_misspelt_command_is_answered_with_those_like_it():
    ran = run_nearfar("rendr")
    assert ran.status == 2
    assert "Did you mean 'render'?" in ran.err


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (("plan", "--projector", "8x8", "--offset", "no"), "inverse, reference, none"),
        (("plan", "--projector", "8x8", "--correspondence", "no"), "stripes, gray, phase, none"),
        (("separate", "out", "--pattern", "no"), "checkerboard, sinusoid, any"),
        (("acquire", "a", "b", "--rig", "c", "--device", "torch"), "cpu, cuda"),
    ],
)
def test_an_unknown_name_is_wrong_usage_and_the_help_lists_the_known(arguments, names):
    ran = run_nearfar(*arguments)
    assert ran.status == 2
    assert f"'{arguments[-1]}' is not one of {names}." in " ".join(ran.err.split())
    assert names.replace(", ", "|") in check_done(run_nearfar(arguments[0], "--help")).out


def _functions(name: str) -> Iterator[ast.FunctionDef]:
    """Yield the functions of the file of a command."""
    spec = find_spec(COMMANDS[name].__module__)
    assert spec is not None
    assert spec.origin is not None
    for node in ast.walk(ast.parse(Path(spec.origin).read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            yield node


@pytest.mark.parametrize("name", COMMANDS.own)
def test_each_command_has_a_file_of_its_own_with_short_bodies(name: str):
    module = import_module(COMMANDS[name].__module__)
    assert [other for other in COMMANDS.own if COMMANDS[other].__module__ == module.__name__] == [
        name
    ]
    for function in _functions(name):
        body = function.body[1:] if ast.get_docstring(function) else function.body
        if body:
            lines = (body[-1].end_lineno or 0) - body[0].lineno + 1
            assert lines <= LONGEST_BODY, f"{function.name} has {lines} lines"
