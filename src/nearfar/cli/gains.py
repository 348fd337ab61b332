"""Gains of components, as commands take them."""

from collections.abc import Mapping
from math import isfinite

import typer

MODEL = ("direct", "near", "far", "free")
PHYSICAL = ("direct", "subsurface", "interreflection")
# The components of either split, each once.
EITHER = (*MODEL, *PHYSICAL[1:])
EXAMPLES = {"direct": 1, "near": 2, "far": 0, "free": 1, "subsurface": 2, "interreflection": 0}


def gains_of(texts: list[str], known: tuple[str, ...] = EITHER) -> dict[str, float]:
    """Read gains of some components, written NAME=VALUE; others are wrong usage."""
    gains: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name in gains:
            raise typer.BadParameter(f"the gain of {name} is given twice.", param_hint="--gain")
        try:
            number = float(value)
        except ValueError:
            number = float("nan")
        if name in EITHER and name not in known:
            raise typer.BadParameter(
                f"{name} is a component of the physical split: give {_listed(known)}.",
                param_hint="--gain",
            )
        if name not in known or not isfinite(number):
            raise typer.BadParameter(
                f"{text!r} is no gain: write {_listed(known, EXAMPLES)}, a finite number each, one "
                f"per --gain.",
                param_hint="--gain",
            )
        gains[name] = number
    return gains


def _listed(names: tuple[str, ...], values: Mapping[str, int] | None = None) -> str:
    """Return names, with their values if there are any, as a list in words."""
    each = [name if values is None else f"{name}={values[name]}" for name in names]
    return f"{', '.join(each[:-1])} or {each[-1]}"
