"""The examples in docstrings of public names, run while the pages are built.

The example of the package itself runs first; those of single names go on from its variables.
"""

import contextlib
import doctest
import inspect
import tempfile
from collections.abc import Iterator
from typing import Any

from sphinx.application import Sphinx

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
_PARSER = doctest.DocTestParser()


class ExampleError(Exception):
    """A public name whose example is missing, or does not do what it shows."""


def run_examples(name: str, thing: Any, variables: dict[str, Any]) -> dict[str, Any]:
    """Run the example of one public name, and those of a class's own methods.

    Returns
    -------
    dict
        Variables of the name's own example when it has ended.

    Raises
    ------
    ExampleError
    """
    examples = _examples_in(thing, name, variables)
    if not examples.examples:
        raise ExampleError(f"{name} has no example")
    _run(examples)
    for method, function in vars(thing).items() if inspect.isclass(thing) else ():
        if not method.startswith("_"):
            _run(_examples_in(function, f"{name}.{method}", variables))
    return examples.globs


def _examples_in(thing: Any, name: str, variables: dict[str, Any]) -> doctest.DocTest:
    text = inspect.getdoc(thing) or ""
    return _PARSER.get_doctest(text, variables, name, None, None)


def _run(examples: doctest.DocTest) -> None:
    said: list[str] = []
    runner = doctest.DocTestRunner(verbose=False, optionflags=FLAGS)
    # The variables are kept: other examples go on from those of the package's own.
    outcome = runner.run(examples, out=said.append, clear_globs=False)
    if outcome.failed:
        raise ExampleError("".join(said))


@contextlib.contextmanager
def public_names() -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Run the package's own example in an empty folder, and stay there.

    Yields
    ------
    things : dict
        Every public name with what it is.
    variables : dict
        Those that the package's example leaves.
    """
    import nearfar

    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        variables = run_examples("nearfar", nearfar, {})
        yield {name: getattr(nearfar, name) for name in nearfar.__all__}, variables


def _run_all(_app: Sphinx) -> None:
    with public_names() as (things, variables):
        for name, thing in things.items():
            run_examples(name, thing, variables)


def setup(app: Sphinx) -> dict[str, bool]:
    """Run the examples before Sphinx reads any page."""
    app.connect("builder-inited", _run_all)
    return {"parallel_read_safe": True}
