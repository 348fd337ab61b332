"""Things of one sort that are looked up by name: nearfar's own, and those of installed packages.

Estimators, cameras, scenes and the like each have a registry. One of nearfar's own is a line in
its registry, a reference ``module:object`` that is loaded when it is first asked for. Another
package adds its own by an entry point of the registry's group::

    [project.entry-points."nearfar.cameras"]
    my-camera = "my_package.camera:DRIVER"
"""

import warnings
from collections.abc import Iterator, Mapping
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Generic, TypeVar

from nearfar.errors import ExtensionError, InputError

Registered = TypeVar("Registered")


class Registry(Generic[Registered]):
    """Objects of one type by name.

    Iterating yields the names: nearfar's own in their order, then those of other packages, sorted.

    Parameters
    ----------
    what : str
        What an object is called in a message, for instance ``"scene"``.
    group : str
        Group of entry points through which other packages add objects.
    own : mapping of str to str
        nearfar's own: a reference ``module:object`` for each name.
    expected : type
        What every object is an instance of.

    Examples
    --------
    >>> from nearfar.registry import Registry
    >>> shapes = Registry("shape", "example.shapes", {"circle": "math:tau"}, float)
    >>> list(shapes), round(shapes["circle"], 2)
    (['circle'], 6.28)
    """

    def __init__(
        self, what: str, group: str, own: Mapping[str, str], expected: type[Registered]
    ) -> None:
        self._what, self._group, self._expected = what, group, expected
        self._own = {name: EntryPoint(name, reference, group) for name, reference in own.items()}
        self._loaded: dict[str, Registered] = {}

    @property
    def own(self) -> tuple[str, ...]:
        """Names of nearfar's own objects."""
        return tuple(self._own)

    def __iter__(self) -> Iterator[str]:
        yield from self._own
        yield from sorted(self._added)

    def __len__(self) -> int:
        return len(self._own) + len(self._added)

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._added

    def __getitem__(self, name: str) -> Registered:
        """Return the object of a name, loaded when it is first asked for.

        Raises
        ------
        InputError
            If nothing has that name.
        ExtensionError
            If another package's object cannot be loaded, or is of another type.
        """
        if name not in self._loaded:
            self._loaded[name] = self._load(name)
        return self._loaded[name]

    def entry(self, name: str) -> EntryPoint:
        """Return where an object comes from; ``dist`` is the package that adds it, None for own.

        Raises
        ------
        InputError
            If nothing has that name.
        """
        found = self._own.get(name) or self._added.get(name)
        if found is None:
            raise InputError(f"there is no {self._what} {name!r}: choose one of {', '.join(self)}.")
        return found

    @cached_property
    def _added(self) -> dict[str, EntryPoint]:
        """Entry points of other packages by name."""
        added: dict[str, EntryPoint] = {}
        for entry in entry_points(group=self._group):
            known = self._own.get(entry.name) or added.get(entry.name)
            if known is None:
                added[entry.name] = entry
            elif known.value != entry.value:
                warnings.warn(
                    f"{_origin(entry)} adds a {self._what} {entry.name!r}, a name that "
                    f"{_origin(known)} already has: it is left out; rename it, or uninstall "
                    f"{_origin(entry)}.",
                    stacklevel=2,
                )
        return added

    def _load(self, name: str) -> Registered:
        entry = self.entry(name)
        if name in self._own:
            found: Registered = entry.load()
            return found
        try:
            found = entry.load()
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())
            raise ExtensionError(
                f"the {self._what} {name!r} of {_origin(entry)} cannot be loaded ({reason}): "
                f"{_cure(entry, error)}."
            ) from error
        if not isinstance(found, self._expected):
            raise ExtensionError(
                f"the {self._what} {name!r} of {_origin(entry)} is of type "
                f"{type(found).__name__}, not {self._expected.__name__}: update or uninstall that "
                f"package."
            )
        return found


def _cure(entry: EntryPoint, error: Exception) -> str:
    """Return the cure for an entry point that cannot be loaded, for a message."""
    missing = error.name if isinstance(error, ModuleNotFoundError) else None
    if missing and missing.partition(".")[0] != entry.module.partition(".")[0]:
        return f"install {missing}, which that package needs, or uninstall that package"
    return "update or uninstall that package"


def _origin(entry: EntryPoint) -> str:
    """Name the package that an entry point came with."""
    return f"the package {entry.dist.name}" if entry.dist is not None else "nearfar"
