"""Patterns and correspondence methods that other packages add to plans."""

import json
from typing import Literal

import numpy as np
import pytest
from pydantic import ValidationError

from nearfar.arrays import Size
from nearfar.errors import ExtensionError, InputError, UnreadableFileError
from nearfar.plan import CORRESPONDENCE_METHODS, Pattern, paper_plan, parse_plan
from nearfar.plan.correspondence import CorrespondencePatterns, pattern_types_of
from nearfar.plan.patterns import OWN_PATTERNS, kinds_of
from nearfar.registry import Registry

PROJECTOR = Size(8, 10)


class Half(Pattern):
    kind: Literal["left half"] = "left half"
    dimmed: bool
    purpose: Literal["correspondence"] = "correspondence"

    def draw(self, size):
        drawn = np.zeros(size, np.uint8)
        drawn[:, : size.width // 2] = 100 if self.dimmed else 255
        return drawn

    def require_place_on(self, projector):
        if projector.width % 2:
            raise ValueError("an odd width has no half")


class Clashing(Half):
    kind: Literal["sine"] = "sine"


HALVES = CorrespondencePatterns(
    patterns=lambda _size: (Half(dimmed=False), Half(dimmed=True)), pattern_types=(Half,)
)
CLASHING = CorrespondencePatterns(pattern_types=(Clashing,))


@pytest.fixture
def _with_halves(monkeypatch):
    own = {name: entry.value for name, entry in CORRESPONDENCE_METHODS._own.items()}
    mine = {"halves": f"{__name__}:HALVES", "clashing": f"{__name__}:CLASHING"}
    more = Registry(
        "correspondence method", "nearfar.correspondences", own | mine, CorrespondencePatterns
    )
    for module in ("correspondence", "model", "paper"):
        monkeypatch.setattr(f"nearfar.plan.{module}.CORRESPONDENCE_METHODS", more)


def _halves(projector=PROJECTOR):
    return paper_plan(projector, 3, Size(3, 3), correspondence="halves")


@pytest.mark.usefixtures("_with_halves")
def test_patterns_of_another_package_are_drawn_stored_and_read():
    plan = _halves()
    assert plan.counts["correspondence"] == 2
    assert parse_plan(plan.to_json()) == plan
    assert plan.to_json().endswith(
        '    {"kind": "left half", "dimmed": true, "purpose": "correspondence"}\n  ]\n}\n'
    )
    assert plan.draw(len(plan.patterns) - 1)[3].tolist() == [100] * 5 + [0] * 5


@pytest.mark.usefixtures("_with_halves")
def test_patterns_of_another_package_are_checked_like_nearfars_own():
    with pytest.raises(ValidationError, match="an odd width has no half"):
        _halves(Size(8, 9))
    damaged = json.loads(_halves().to_json())
    damaged["patterns"][-1]["dimmed"] = "very"
    with pytest.raises(
        UnreadableFileError, match=r"damaged plan: patterns\.\d+\.left half\.dimmed"
    ):
        parse_plan(json.dumps(damaged))
    with pytest.raises(ExtensionError, match="'clashing' adds a pattern kind 'sine'"):
        pattern_types_of("clashing")


@pytest.mark.parametrize(
    ("method", "message"),
    [
        (
            "halves",
            r"my\.json needs the correspondence method 'halves', which is not installed: in",
        ),
        ("phase", r"my\.json has patterns of the kind 'left half', which neither nearfar nor"),
    ],
)
@pytest.mark.usefixtures("_with_halves")
def test_what_is_not_installed_is_named(monkeypatch, method, message):
    text = json.dumps(json.loads(_halves().to_json()) | {"correspondence": method})
    monkeypatch.undo()
    with pytest.raises(UnreadableFileError, match=message):
        parse_plan(text, source="my.json")


def test_an_unknown_method_is_refused():
    with pytest.raises(InputError, match="no correspondence method 'laser': choose one of stripes"):
        paper_plan(PROJECTOR, 3, Size(3, 3), correspondence="laser")


def test_no_two_of_nearfars_patterns_share_a_kind():
    kinds = [kind for pattern in OWN_PATTERNS for kind in kinds_of(pattern)]
    assert len(kinds) == len(set(kinds)) == 13
