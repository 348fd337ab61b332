"""Tables of how close the components of either split come to a known scene's."""

from collections.abc import Mapping
from typing import Any

from nearfar.decibels import in_words
from nearfar.markup import numbers
from nearfar.workflow.evaluate import HIGHEST

# Which split is which, for whoever has read nothing else.
PHYSICAL_SPLIT = (
    "The physical split has direct light, subsurface light, which travels under a translucent "
    "surface, and inter-reflection, which goes from surface to surface, in a crease, too."
)
MODEL_SPLIT = (
    "The model's split has direct light at one place of the projector, near-range light from a "
    "window about it, and far-range light of a few low frequencies. Light of creases is near-range."
)
MODEL_HEADS = {
    "floodlit": "its floodlit picture",
    "physical": "its rows, by physics",
    "model": "its rows, by the model",
}
PHYSICAL_NAMES = {
    "direct": "direct",
    "subsurface": "subsurface",
    "interreflection": "inter-reflection",
}


def splits_section(judgement: Mapping[str, Any]) -> str:
    """Return the tables of both splits as HTML; nothing where components were not compared.

    Parameters
    ----------
    judgement : mapping
        As `nearfar.workflow.judge.judge_by_truth` returns it.
    """
    return _physical(judgement) + _model(judgement)


def _physical(judgement: Mapping[str, Any]) -> str:
    if "physical_split" not in judgement:
        return ""
    found = judgement["physical_split"]
    table = numbers(
        ["component", "its floodlit picture"],
        [
            [shown, in_words(found[name]) if name in found else "the scene has none"]
            for name, shown in PHYSICAL_NAMES.items()
        ],
    )
    return f"<h3>The physical split</h3><p>{PHYSICAL_SPLIT}</p>{table}"


def _model(judgement: Mapping[str, Any]) -> str:
    split = judgement.get("snr", {})
    if "physical" not in split:
        return ""
    shown = [how for how in MODEL_HEADS if how in split]
    rows = [
        [what, *(_decibels(split[how][key]) for how in shown)]
        for what, key in (("direct", "D"), ("near-range", "N"), ("far-range", "F"))
    ]
    beside = (
        "Pictures and rows by physics stand beside the scene's subsurface light and "
        "inter-reflection, rows by the model beside the model's split of the scene."
    )
    table = numbers(["component", *(MODEL_HEADS[how] for how in shown)], rows)
    return f"<h3>The model's split</h3><p>{MODEL_SPLIT} {beside}</p>{table}"


def _decibels(value: float) -> str:
    return in_words(value) if value > -HIGHEST else "the scene has none"
