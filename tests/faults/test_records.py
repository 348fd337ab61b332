"""Faults in words: one sentence each, with the cure."""

import dataclasses
from pathlib import Path
from typing import Literal, get_origin, get_type_hints

import pytest

from nearfar.faults import records
from nearfar.faults.of_capture import find_saturation
from nearfar.faults.records import LightChange, LightChanged, LightChangedBefore, PhotoTakenAgain
from nearfar.illumination.frequencies import Frequency

# Not a sentence by itself.
PARTS = {LightChange}
FAULTS = [
    kind
    for kind in vars(records).values()
    if isinstance(kind, type) and dataclasses.is_dataclass(kind) and kind not in PARTS
]
EXAMPLES = {
    str: "the camera",
    float: 0.25,
    int: 7,
    bool: True,
    Path: Path("c.zarr"),
    Frequency: Frequency(0, 3),
    LightChange: LightChange("lamp", -0.2),
    int | None: 4,
}


def _example(kind):
    hints = get_type_hints(kind)
    return kind(
        **{
            field.name: "white"
            if get_origin(hints[field.name]) is Literal
            else EXAMPLES[hints[field.name]]
            for field in dataclasses.fields(kind)
        }
    )


@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_is_one_frozen_sentence(kind):
    fault = _example(kind)
    text = str(fault)
    assert text.endswith(".")
    assert not text.endswith("..")
    assert "\n" not in text
    assert "  " not in text
    assert len(text) > 30
    assert "object at" not in text
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(fault, dataclasses.fields(kind)[0].name, 0)


def test_photos_that_may_be_spoilt_are_named():
    change = LightChange("ambient", 0.1)
    text = str(LightChanged(change, 29, 34))
    assert "ambient light changed by +10.0% of white, after photo 29" in text
    assert text.endswith("by `shoot_again(numbers=range(30, 35))`.")
    text = str(LightChanged(LightChange("any", -0.03), None, 3))
    assert "before the first comparison" in text
    assert text.endswith("by `shoot_again(numbers=range(0, 4))`.")
    assert "before photo 8: check" in str(LightChangedBefore(change, 8))


def test_a_reason_may_be_a_sentence_or_not():
    for reason in ("it was lost", "it was lost."):
        assert str(PhotoTakenAgain(5, reason)) == "photo 5 was taken again: it was lost."


def test_few_saturated_values_are_no_fault():
    assert find_saturation("c.zarr", 1e-4) == []
    (fault,) = find_saturation("c.zarr", 0.02)
    assert str(fault).startswith("2.00% of the values in c.zarr are saturated")
