"""Registries: nearfar's own objects, those of other packages, and what is wrong with either."""

import sys
from pathlib import Path

import pytest

from nearfar.errors import ExtensionError, InputError
from nearfar.registry import Registry
from tests.packages import write_package

OWN = {"pi": "math:pi", "absent": "nearfar.no_such_module:VALUE"}


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Return a function that installs a package with one module and entry points."""

    def installed(package: str, module: str, entries: dict[str, str]) -> None:
        folder = tmp_path / package
        write_package(folder, package, module, "nearfar.numbers", entries)
        monkeypatch.syspath_prepend(str(folder))

    yield installed
    for name in ("added", "other"):
        sys.modules.pop(name, None)


def numbers() -> Registry[float]:
    return Registry("number", "nearfar.numbers", OWN, float)


def test_own_objects_come_in_their_order_and_are_loaded_when_asked_for() -> None:
    registry = numbers()
    assert list(registry) == list(registry.own) == ["pi", "absent"]
    assert registry["pi"] == pytest.approx(3.14159, abs=1e-5)
    assert len(registry) == 2
    assert "pi" in registry
    assert "tau" not in registry


def test_an_own_object_that_cannot_be_loaded_keeps_its_own_fault() -> None:
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        numbers()["absent"]


def test_another_package_adds_objects_behind_the_own(install) -> None:
    install("added", "B = 2.0\nA = 1.0\n", {"b": "added:B", "a": "added:A"})
    registry = numbers()
    assert list(registry) == ["pi", "absent", "a", "b"]
    assert registry.own == ("pi", "absent")
    assert registry["b"] == 2.0
    assert registry["b"] is registry["b"]


def test_an_unknown_name_is_refused_with_all_that_there_are(install) -> None:
    install("added", "A = 1.0\n", {"a": "added:A"})
    with pytest.raises(InputError, match="there is no number 'e': choose one of pi, absent, a"):
        numbers()["e"]


@pytest.mark.parametrize(
    ("module", "sentence"),
    [
        ("raise RuntimeError('no licence')", "RuntimeError: no licence"),
        ("import nosdk.api", "No module named 'nosdk'.*: install nosdk, which that package needs"),
        ("A = (", "SyntaxError"),
        ("B = 1.0", "has no attribute 'A'"),
        ("A = 'one'", "is of type str, not float"),
    ],
)
def test_an_object_that_cannot_be_used_names_its_package(install, module, sentence) -> None:
    install("added", module, {"a": "added:A"})
    registry = numbers()
    assert "a" in registry, "a broken package does not keep others from being listed"
    with pytest.raises(ExtensionError, match=sentence) as caught:
        registry["a"]
    assert "'a' of the package added" in str(caught.value)
    assert isinstance(caught.value, ImportError)


def test_a_name_that_is_taken_is_left_out_with_a_warning(install) -> None:
    install("added", "A = 1.0\n", {"a": "added:A", "pi": "added:A"})
    install("other", "A = 2.0\n", {"a": "other:A"})
    registry = numbers()
    with pytest.warns(UserWarning, match="a name that") as caught:
        names = list(registry)
    assert names == ["pi", "absent", "a"]
    assert registry["pi"] == pytest.approx(3.14159, abs=1e-5)
    said = "\n".join(str(one.message) for one in caught)
    assert "a number 'pi', a name that nearfar already has" in said
    assert "a number 'a', a name that the package" in said
