"""Plans that were damaged or written by something else: read, or a sentence at once."""

import json
import random
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from nearfar.arrays import Size
from nearfar.errors import UnreadableFileError
from nearfar.illumination.frequencies import LARGEST_DENOMINATOR
from nearfar.plan import paper_plan, parse_plan, read_plan
from nearfar.plan.model import LARGEST_SIDE
from nearfar.report.plan import describe_plan

TEXT = paper_plan(Size(8, 9), 3, Size(3, 3), correspondence="gray").to_json()
# What no reader expects: of another type, of no size, or of any.
HOSTILE: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 7.5, float("inf"), float("nan"), 10**9, 2**63, 10**300, "", "x"),
    *("1/0", "1e999999999", "9" * 999, [], [1], [1, 2, 3], [10**9, 10**9], [None, None], {}),
    *([float("inf"), 3], ["1/3", "1/3"], ["1e999999999", "0"], [float("inf"), "0"], [0.1, 0]),
)


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """Yield each value in some JSON by what it is in and its key there."""
    for key in data if isinstance(data, dict) else range(len(data)):
        yield data, key
        if isinstance(data[key], dict | list):
            yield from _places(data[key])


def _read(text: str) -> bool:
    """Read a plan and use it; return whether it is one."""
    try:
        plan = parse_plan(text, source="p.json")
    except UnreadableFileError as error:
        message = str(error)
        assert message.startswith("p.json ")
        assert message.endswith(".")
        assert "\n" not in message
        assert len(message) < 400
        return False
    describe_plan(plan)
    for index in range(len(plan.patterns)):
        plan.draw(index)
    return True


@pytest.mark.parametrize("name", ["projector", "window", "far", "dropped"])
def test_a_size_of_any_kind_is_refused_at_once(name: str):
    for value in HOSTILE:
        assert not _read(json.dumps(json.loads(TEXT) | {name: value}))


@pytest.mark.parametrize("pitch", [0, -2, 4.0, 10**300, None, "2", True])
def test_a_pitch_that_is_none_is_refused(pitch: object):
    assert not _read(json.dumps(json.loads(TEXT) | {"pitch": pitch}))


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("projector", [8, LARGEST_SIDE + 1], f"its projector of 8x{LARGEST_SIDE + 1}"),
        ("window", 9, "its window of 9x9 is larger than 8x9"),
        ("pitch", 4, "its window of 9x9 is larger than 8x9"),
        ("pitch", 3, "pitch: a pitch of 3 is not a power of two"),
        ("far", [3, 10], "its far of 3x10 is larger than 8x9"),
        ("dropped", [5, 1], "its dropped of 5x1 is larger than 3x3"),
        ("patterns", [], "it has no photos of transport"),
        ("far", None, "far: the size None is not a size: give two whole numbers"),
    ],
)
def test_what_does_not_fit_is_named(name: str, value: object, words: str):
    with pytest.raises(UnreadableFileError) as caught:
        parse_plan(json.dumps(json.loads(TEXT) | {name: value}))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "frequency",
    [
        None,
        7,
        "1/3",
        ["1/3"],
        ["1/3", None],
        [float("inf"), "0"],
        ["0", "1e-999999999"],
        ["0", "1e999999999"],
        [str(Fraction(1, LARGEST_DENOMINATOR + 1)), "0"],
    ],
)
def test_a_frequency_that_is_none_is_refused_at_once(frequency: object):
    data = json.loads(TEXT)
    data["patterns"][3]["frequency"] = frequency
    with pytest.raises(UnreadableFileError, match=r"patterns.*frequenc"):
        parse_plan(json.dumps(data))


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"format": ' + "[" * 100_000,
        TEXT.replace('"window": 3', f'"window": {"9" * 5000}'),
        TEXT.replace('"version": 7', f'"version": {"9" * 4000}'),
        TEXT.replace('"version": 7', f'"version": {[[]] * 500}'),
    ],
)
def test_text_that_no_reader_takes_is_refused(text: str):
    assert not _read(text)


def test_a_loop_of_links_is_refused(tmp_path: Path):
    path = tmp_path / "p.json"
    path.symlink_to(path)
    with pytest.raises(UnreadableFileError, match=r"p\.json cannot be read as a plan"):
        read_plan(path)


def test_plans_mutated_anywhere_are_read_or_refused():
    generator = random.Random(1)
    refused = 0
    for _ in range(300):
        data = json.loads(TEXT)
        inside, key = generator.choice(list(_places(data)))
        inside[key] = generator.choice(HOSTILE)
        refused += not _read(json.dumps(data))
    assert refused > 200
