"""Correspondence methods by name, and what a plan needs of each: the patterns of its own."""

from collections.abc import Callable
from dataclasses import dataclass

from nearfar.arrays import Size
from nearfar.errors import ExtensionError
from nearfar.plan.patterns import OWN_PATTERNS, Pattern, kinds_of
from nearfar.registry import Registry


def no_patterns(_projector: Size) -> tuple[Pattern, ...]:
    """Return no patterns: for methods that need no photos of their own."""
    return ()


@dataclass(frozen=True, kw_only=True)
class CorrespondencePatterns:
    """The patterns that a correspondence method adds to a plan.

    A method that finds q in the photos is a `nearfar.correspondence.CorrespondenceMethod`, which
    is one of these; one that is only this leaves q to be given, or found by another method.

    Attributes
    ----------
    patterns : callable
        From a projector's size to the patterns that the method adds to a plan, in the order to
        shoot; their purpose is "correspondence".
    pattern_types : tuple of subclasses of Pattern
        Kinds of pattern that `patterns` uses and nearfar does not have.
    """

    patterns: Callable[[Size], tuple[Pattern, ...]] = no_patterns
    pattern_types: tuple[type[Pattern], ...] = ()


# q is known from elsewhere, so that no photo need be spent on it.
NONE = CorrespondencePatterns()

# The methods themselves lie above plans, which only ask for their patterns.
CORRESPONDENCE_METHODS = Registry(
    "correspondence method",
    "nearfar.correspondences",
    {
        "stripes": "nearfar.correspondence.stripes:STRIPES",
        "gray": "nearfar.correspondence.gray:GRAY_CODE",
        "phase": "nearfar.correspondence.phase:PHASE",
        "none": "nearfar.plan.correspondence:NONE",
    },
    CorrespondencePatterns,
)


def pattern_types_of(name: str) -> tuple[type[Pattern], ...]:
    """Return the kinds of pattern that a method adds to nearfar's own.

    Raises
    ------
    ExtensionError
        If the method cannot be loaded, or one of its kinds has the name of one of nearfar's.
    """
    added = CORRESPONDENCE_METHODS[name].pattern_types
    taken = frozenset[str]().union(*map(kinds_of, OWN_PATTERNS))
    for pattern in added:
        if clash := taken & kinds_of(pattern):
            raise ExtensionError(
                f"the correspondence method {name!r} adds a pattern kind {min(clash)!r}, a name "
                f"that is taken: update or uninstall its package."
            )
        taken |= kinds_of(pattern)
    return added
