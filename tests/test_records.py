"""Records that hold arrays compare by identity: arrays have no one answer to ==, and no hash."""

import ast
import re
from pathlib import Path

import nearfar

SOURCES = Path(nearfar.__file__).parent
ARRAYS = re.compile(r"\b(Floats|Complexes|Integers|Booleans|NDArray|ndarray|csr_array)\b")


def _records():
    """Yield each dataclass with an array among its fields, and its decorator."""
    for path in SOURCES.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if not isinstance(node, ast.ClassDef):
                continue
            fields = [part for part in node.body if isinstance(part, ast.AnnAssign)]
            if any(ARRAYS.search(ast.unparse(field.annotation)) for field in fields):
                for decorator in map(ast.unparse, node.decorator_list):
                    if decorator.startswith("dataclass"):
                        yield f"{path.name}: {node.name}", decorator


def test_records_of_arrays_compare_by_identity():
    found = dict(_records())
    assert len(found) > 20
    assert [name for name, decorator in found.items() if "eq=False" not in decorator] == []
