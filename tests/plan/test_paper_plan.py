"""Counts, patterns and files of the paper's plan."""

import json
from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError, MissingFileError, PlanError, UnreadableFileError
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    default_dropped,
    far_frequencies,
    near_frequencies,
    representatives,
)
from nearfar.plan import Plan, Sinusoid, Stripe, paper_plan, parse_plan, read_plan


@pytest.mark.parametrize(
    ("projector", "window", "far", "dropped", "offset", "photos", "savings"),
    [
        (Size(128, 128), 19, Size(13, 13), None, "inverse", 1060, 15.457),
        (Size(128, 128), 15, Size(13, 13), None, "inverse", 788, 20.792),
        (Size(68, 100), 19, Size(7, 10), Size(3, 3), "none", 423, 16.076),
    ],
)
def test_the_papers_counts(projector, window, far, dropped, offset, photos, savings):
    plan = paper_plan(projector, window, far, dropped=dropped, offset=offset)
    assert plan.transport_photos == photos
    assert plan.savings == pytest.approx(savings, abs=5e-4)
    assert plan.summary()["photos"]["correspondence"] == sum(projector)
    assert plan.summary()["total_photos"] == photos + sum(projector)


SIZES = [
    (Size(16, 16), 5, Size(3, 3)),
    (Size(17, 17), 5, Size(5, 5)),
    (Size(16, 20), 8, Size(3, 5)),
    (Size(20, 16), 7, Size(4, 6)),
    (Size(15, 22), 6, Size(5, 3)),
    (Size(24, 24), 8, Size(4, 4)),
    (Size(12, 30), 12, Size(3, 7)),
    (Size(33, 18), 9, Size(5, 5)),
    (Size(9, 9), 9, Size(3, 3)),
    (Size(10, 13), 1, Size(3, 3)),
    (Size(10, 12), 2, Size(4, 3)),
]


@pytest.mark.parametrize(("projector", "window", "far"), SIZES)
def test_exported_patterns_have_full_rank_over_their_span(projector, window, far):
    plan = paper_plan(projector, window, far, correspondence="none")
    drawn = np.stack([plan.draw(i).ravel() for i in range(len(plan.patterns))]).astype(float)
    # Each pair adds one direction, and white, which every pair sums to, is the DC pair's.
    # (Where W is the projector's side, near and far together are all of its DFT already.)
    expected = min(plan.transport_photos // 2, projector.pixels)
    assert np.linalg.matrix_rank(drawn / 255.0, tol=1e-6) == expected


@pytest.mark.parametrize(("projector", "window", "far"), SIZES)
def test_every_pattern_and_its_inverse_sum_to_white(projector, window, far):
    plan = paper_plan(projector, window, far, correspondence="none")
    drawn = [plan.draw(i).astype(int) for i in range(len(plan.patterns))]
    for shown, inverse in zip(drawn[::2], drawn[1::2], strict=True):
        assert np.all(shown + inverse == 255)


@pytest.mark.parametrize(("projector", "window", "far"), SIZES)
def test_photos_count_the_real_unknowns(projector, window, far):
    plan = paper_plan(projector, window, far, correspondence="none")

    def unknowns(frequencies):
        # +-k share a cosine and a sine; what is its own negative has no sine.
        return sum(1 if k.is_own_negative else 2 for k in representatives(frequencies))

    assert plan.counts["direct"] == 2
    assert plan.counts["near"] == 2 * unknowns(near_frequencies(window, plan.dropped))
    assert plan.counts["far"] == 2 * unknowns(far_frequencies(far, projector))
    if far.height % 2 and far.width % 2:
        assert plan.counts["far"] == 2 * far.pixels
    if window % 2:
        assert plan.counts["near"] == 2 * (window**2 - plan.dropped.pixels)


def test_an_even_window_shoots_the_checkerboard_once():
    plan = paper_plan(Size(24, 24), 8, Size(3, 3))
    shots = [p for p in plan.patterns if isinstance(p, Sinusoid) and p.frequency == CHECKERBOARD]
    assert [p.purpose for p in shots] == ["direct", "direct"]
    assert paper_plan(Size(24, 24), 8, Size(3, 3), offset="none").counts["near"] == 64 - 1 - 1


@pytest.mark.parametrize(("projector", "window", "far"), SIZES)
def test_with_references_each_pattern_is_shot_once(projector, window, far):
    pairs = paper_plan(projector, window, far, correspondence="none")
    plan = paper_plan(projector, window, far, offset="reference", correspondence="none")
    assert plan.transport_photos == pairs.transport_photos // 2
    drawn = np.stack([plan.draw(i) for i in range(len(plan.patterns))])
    whites, blacks = (int(np.all(drawn == level, axis=(1, 2)).sum()) for level in (255, 0))
    # One white is the DC frequency's own.
    assert whites == blacks == (plan.counts["reference"] + 1) // 2 >= 2
    black = np.zeros(projector, dtype=np.uint8).tobytes()
    wanted = {shown.tobytes() for shown in map(pairs.draw, range(0, len(pairs.patterns), 2))}
    assert {shown.tobytes() for shown in drawn} == wanted | {black}
    assert len(drawn) == len(wanted) + whites - 1 + blacks
    assert parse_plan(plan.to_json()) == plan


def test_the_theory_counts_a_complex_pattern_per_frequency():
    plan = paper_plan(Size(20, 20), 7, Size(4, 6), offset="none")
    assert plan.counts["far"] == 24
    # 3/20 > 1/7 > 2/20: the near set loses three frequencies across and one down.
    assert plan.counts["near"] == 49 - 3


def test_the_checkerboard_is_a_checkerboard():
    plan = paper_plan(Size(7, 6), 3, Size(3, 3))
    y, x = np.indices((7, 6))
    np.testing.assert_array_equal(plan.draw(0), np.where((y + x) % 2, 0, 255))


def test_white_and_black_are_the_dc_pair():
    plan = paper_plan(Size(8, 8), 3, Size(3, 3))
    found = {
        pattern.inverse: plan.draw(i)
        for i, pattern in enumerate(plan.patterns)
        if isinstance(pattern, Sinusoid) and pattern.frequency == DC
    }
    assert np.all(found[False] == 255)
    assert np.all(found[True] == 0)


def test_stripes_black_out_each_row_and_column_once():
    plan = paper_plan(Size(6, 9), 3, Size(3, 3))
    stripes = [i for i, p in enumerate(plan.patterns) if isinstance(p, Stripe)]
    drawn = np.stack([plan.draw(i) for i in stripes])
    assert np.all(np.sum(drawn == 0, axis=0) == 2)
    assert len(stripes) == 15


def test_default_dropped_are_the_frequencies_up_to_k_far():
    # W = 24 on 128 pixels: 1/24 < 6/128 < 2/24.
    assert default_dropped(24, Size(13, 13), Size(128, 128)) == Size(3, 3)
    assert default_dropped(19, Size(13, 13), Size(128, 128)) == Size(1, 1)
    # k_far itself is dropped: 3/16 = 12/64 exactly.
    assert default_dropped(16, Size(25, 9), Size(64, 64)) == Size(7, 3)
    kept = near_frequencies(24, Size(3, 3))
    assert all(max(abs(k.fy), abs(k.fx)) > 6 / 128 for k in kept)


def test_sinusoids_far_from_the_origin_are_exact():
    plan = paper_plan(Size(4, 5000), 3, Size(1, 3), correspondence="none")
    k = next(p.frequency for p in plan.patterns if p.purpose == "near" and p.frequency.fx > 0)
    assert k.fx.denominator == 3
    number = next(i for i, p in enumerate(plan.patterns) if p.frequency == k and p.kind == "cosine")
    drawn = plan.draw(number)
    np.testing.assert_array_equal(drawn[:, :3], drawn[:, 4998 - 3 : 4998])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((Size(16, 8), 9, Size(3, 3)), "W = 9 does not fit a projector of 16x8"),
        ((Size(16, 16), 5, Size(17, 3)), "far band 17x3 is larger"),
        ((Size(16, 10**8), 5, Size(3, 3)), "a side over 16384"),
    ],
)
def test_what_does_not_fit_is_refused(arguments, message):
    with pytest.raises(PlanError, match=message):
        paper_plan(*arguments)


@pytest.mark.parametrize("dropped", [Size(2, 3), Size(3, 4), Size(7, 7)])
def test_a_block_that_is_not_around_dc_is_refused(dropped):
    with pytest.raises(PlanError, match="`dropped="):
        paper_plan(Size(16, 16), 5, Size(3, 3), dropped=dropped)


def test_complex_patterns_cannot_be_drawn():
    plan = paper_plan(Size(8, 8), 3, Size(3, 3), offset="none")
    with pytest.raises(PlanError, match="`offset='inverse'`"):
        plan.draw(0)


def test_a_plan_comes_back_from_its_file(tmp_path: Path):
    plan = paper_plan(Size(16, 20), 6, Size(4, 5))
    path = tmp_path / "plan.json"
    path.write_text(plan.to_json())
    assert read_plan(path) == plan


def _changed(**changes: object) -> str:
    data = json.loads(paper_plan(Size(8, 8), 3, Size(3, 3)).to_json())
    data.update(changes)
    return json.dumps(data)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no JSON"),
        ("{", "no JSON"),
        ("[]", "not a nearfar plan"),
        ("{}", "not a nearfar plan"),
        (_changed(version=8), "version 8, this nearfar reads versions 1 to 7"),
        (_changed(version=None), "version None"),
        (_changed(colour="red"), "damaged plan: colour"),
        (_changed(window=0), "damaged plan: window"),
        (_changed(projector=[4, 4]), "outside the projector"),
        (_changed(patterns=[{"kind": "sine"}]), "damaged plan: patterns"),
        (
            _changed(patterns=[{"kind": "sine", "frequency": ["3/4", "0"], "purpose": "far"}]),
            "damaged plan: patterns.0",
        ),
        (
            _changed(patterns=[{"kind": "sine", "frequency": ["1/0", "0"], "purpose": "far"}]),
            "damaged plan: patterns.0",
        ),
    ],
)
def test_a_damaged_plan_gets_a_sentence(text, message):
    with pytest.raises(UnreadableFileError, match=message):
        parse_plan(text)


def test_a_missing_plan_gets_a_sentence(tmp_path: Path):
    with pytest.raises(MissingFileError, match=r"nothing\.json is not there"):
        read_plan(tmp_path / "nothing.json")
    assert issubclass(MissingFileError, FileNotFoundError)
    with pytest.raises(UnreadableFileError, match="cannot be read"):
        read_plan(tmp_path)


def test_plans_are_frozen():
    plan = paper_plan(Size(8, 8), 3, Size(3, 3))
    with pytest.raises(ValueError, match="frozen"):
        plan.window = 5
    assert issubclass(PlanError, InputError)
    assert isinstance(plan, Plan)


def test_a_plan_prints_in_a_line():
    plan = paper_plan((8, 8), 3, (3, 3))
    assert str(plan) == f"<nearfar plan: projector 8x8, {len(plan.patterns)} photos>"
