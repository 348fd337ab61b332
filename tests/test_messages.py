"""Messages of the library speak to Python: they name parameters, and no option of a command."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import nearfar
from nearfar.cli.flags import CODE, in_flags

SOURCE = Path(nearfar.__file__).parent
FLAG = re.compile(r"(?<![\w-])--[a-z]")
# Options of other programs, and properties of style sheets.
OTHERS = re.compile(r"gphoto2 --[a-z-]+|--filename \{\}|--memory-limit|var\(--\w+\)|--\w+: #\w+")
MODULES = sorted(
    str(path.relative_to(SOURCE))
    for path in SOURCE.rglob("*.py")
    if path.relative_to(SOURCE).parts[0] != "cli"
)
# What a value that is known when the program runs may be.
VALUE = "3"
# Parameters that no command has, and what is no message.
OF_PYTHON_ALONE = {"([^", "tiles_at_once", "light[None]"}


def _texts(module: str) -> Iterator[str]:
    """Yield the strings of a module that are no docstrings, with `VALUE` for what they put in."""
    tree = ast.parse((SOURCE / module).read_text(encoding="utf-8"))
    left_out: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            left_out.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            left_out.update(node.values)
            parts = [p.value if isinstance(p, ast.Constant) else VALUE for p in node.values]
            yield "".join(map(str, parts))
        elif (
            isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in left_out
        ):
            yield node.value


def test_no_message_names_an_option_of_the_command_line():
    found = [
        (module, text)
        for module in MODULES
        for text in _texts(module)
        if FLAG.search(OTHERS.sub("", text))
    ]
    assert found == []


def test_the_command_line_has_options_for_what_messages_name():
    unknown = [
        (module, code)
        for module in MODULES
        for text in _texts(module)
        for code in CODE.findall(text)
        if in_flags(code) is None and code not in OF_PYTHON_ALONE
    ]
    assert unknown == []
