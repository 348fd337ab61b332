"""Gains of components, as commands take them."""

from math import isfinite

import typer

MODEL = ("direct", "near", "far", "free")
PHYSICAL = ("direct", "subsurface", "interreflection")


def gains_of(texts: list[str]) -> dict[str, float]:
    """Read gains written NAME=VALUE; others are wrong usage."""
    gains: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        if name in gains:
            raise typer.BadParameter(f"the gain of {name} is given twice.", param_hint="--gain")
        try:
            number = float(value)
        except ValueError:
            number = float("nan")
        if name not in MODEL + PHYSICAL or not isfinite(number):
            raise typer.BadParameter(
                f"{text!r} is no gain: write direct=1, near=2, far=0, subsurface=2, "
                f"interreflection=0 or free=1, one per --gain.",
                param_hint="--gain",
            )
        gains[name] = number
    return gains
