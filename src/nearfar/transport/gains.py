"""Gains by which the components of a transport were multiplied after it was reconstructed.

Its provenance keeps them as ``gains``, so that nobody takes it for what photos showed.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

from nearfar.checks import as_number
from nearfar.transport.edits import edits_of
from nearfar.transport.parts import Parts, require_parts

GAINS = "gains"


class Gains(NamedTuple):
    """A factor for each component."""

    direct: float = 1.0
    near: float = 1.0
    far: float = 1.0

    def __str__(self) -> str:
        direct, near, far = (f"{name} {gain:g}" for name, gain in self._asdict().items())
        return f"{direct}, {near} and {far}"


def as_gains(direct: float, near: float, far: float) -> Gains:
    """Return the gains of the components as floats.

    Raises
    ------
    InputError
        If one is not a finite number.
    """
    return Gains(
        as_number(direct, "the gain of direct"),
        as_number(near, "the gain of near"),
        as_number(far, "the gain of far"),
    )


def gains_on(parts: Parts, direct: float, near: float, far: float, free: float) -> Gains:
    """Return the gains of the components of a transport; that of free rows stands as `far`.

    Raises
    ------
    InputError
        If one is not a finite number, or changes a part that the transport does not have.
    """
    free = as_number(free, "the gain of free")
    gains = as_gains(direct, near, far)
    given = {**gains._asdict(), "free": free}
    require_parts(parts, [name for name, gain in given.items() if gain != 1.0])
    return gains._replace(far=free) if "free" in parts else gains


def gains_of(provenance: Mapping[str, Any]) -> Gains:
    """Return the gains that a provenance keeps; 1 each if it keeps none.

    Raises
    ------
    KeyError, TypeError, ValueError, OverflowError
        If what it keeps are no gains.
    """
    if GAINS not in provenance:
        return Gains()
    kept = provenance[GAINS]
    gains = Gains(*(float(kept[name]) for name in Gains._fields))
    if not all(map(math.isfinite, gains)):
        raise ValueError(f"{gains} are not finite gains")
    return gains


def with_gains(provenance: Mapping[str, Any], gains: Gains) -> dict[str, Any]:
    """Return the provenance of a transport after gains; those that it keeps are multiplied by them.

    Raises
    ------
    InputError
        If a product is not finite.
    """
    products = as_gains(*(a * b for a, b in zip(gains_of(provenance), gains, strict=True)))
    changed = {name: value for name, value in provenance.items() if name != GAINS}
    return changed if products == Gains() else {**changed, GAINS: products._asdict()}


def why_unjudgeable(provenance: Mapping[str, Any]) -> str | None:
    """Return why a transport of a provenance cannot be judged, a predicate of it, and the cure.

    None if neither gains nor edits changed it.
    """
    if edits_of(provenance):
        return (
            "was edited after it was reconstructed, so that the photos of its capture do not tell "
            "how far it can be trusted: judge the transport as it was reconstructed."
        )
    gains = gains_of(provenance)
    if gains == Gains():
        return None
    return (
        f"was multiplied by the gains {gains} after it was reconstructed, so that the photos of "
        f"its capture do not tell how far it can be trusted: judge the transport as it was "
        f"reconstructed."
    )
