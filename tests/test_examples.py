"""Every public name has an example, and every example does what it shows."""

import importlib.util
from pathlib import Path

import pytest

import nearfar

_SPEC = importlib.util.spec_from_file_location(
    "examples", Path(__file__).parents[1] / "docs" / "extensions" / "examples.py"
)
examples = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(examples)


@pytest.fixture(scope="module")
def shown():
    """Every public name's object, and the variables that the package's example leaves."""
    with examples.public_names() as found:
        yield found


@pytest.mark.parametrize("name", nearfar.__all__)
def test_the_example_of_a_public_name_runs(name, shown):
    things, variables = shown
    examples.run_examples(name, things[name], variables)


def _without():
    """Do nothing."""


def _wrong():
    """Add.

    >>> 1 + 1
    3
    """


class _WrongWithin:
    """Do something.

    >>> 1 + 1
    2
    """

    def method(self):
        """Add.

        >>> 1 + 1
        3
        """


@pytest.mark.parametrize(
    ("thing", "message"),
    [(_without, "has no example"), (_wrong, "Expected"), (_WrongWithin, "Expected")],
)
def test_a_missing_or_wrong_example_is_seen(thing, message):
    with pytest.raises(examples.ExampleError, match=message):
        examples.run_examples("name", thing, {})
