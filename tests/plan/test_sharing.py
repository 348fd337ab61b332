"""Plans whose photos several projectors share."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import PlanError, UnreadableFileError
from nearfar.plan import choose_plan, paper_plan, parse_plan
from nearfar.plan.patterns import SideBySide
from nearfar.plan.sharing import plan_of_each, projectors_of, shared_plan, signs

GRID = Size(8, 10)


def plan(offset="reference"):
    return paper_plan(GRID, 3, Size(3, 3), offset=offset)


@pytest.mark.parametrize(("projectors", "photos"), [(2, 2), (3, 4), (4, 4), (5, 8)])
def test_what_projectors_show_is_orthogonal(projectors, photos):
    found = signs(projectors)
    assert found.shape == (photos, projectors)
    np.testing.assert_array_equal(found.T @ found, photos * np.eye(projectors))
    assert (found[0] == 1).all()


@pytest.mark.parametrize("offset", ["reference", "inverse"])
@pytest.mark.parametrize("projectors", [2, 3])
def test_each_projector_shows_the_pattern_or_its_inverse(offset, projectors):
    made, each = plan(offset), signs(projectors)
    shared = shared_plan(made, projectors)
    assert len(shared.patterns) == len(made.patterns) * len(each)
    assert shared.projector == Size(8, 10 * projectors)
    for number in (0, 3, len(shared.patterns) - 1):
        pattern = made.draw(number // len(each))
        parts = np.split(shared.draw(number), projectors, axis=1)
        for part, sign in zip(parts, each[number % len(each)], strict=True):
            np.testing.assert_array_equal(part, pattern if sign > 0 else 255 - pattern)


def test_the_plan_of_each_is_found_again_also_from_a_file():
    made, _ = choose_plan((16, 16), 40)
    shared = parse_plan(shared_plan(made, 2).to_json())
    assert plan_of_each(shared) == made
    assert (projectors_of(shared), projectors_of(made)) == (2, 1)
    # A capture that ended early: whole patterns alone.
    early = plan_of_each(shared.first(31))
    assert early.patterns == made.patterns[:15]


def test_what_cannot_be_shared_gets_a_sentence():
    made = plan()
    for count in (1, 17):
        with pytest.raises(PlanError, match=f"by {count} projectors"):
            shared_plan(made, count)
    with pytest.raises(PlanError, match="shared already"):
        shared_plan(shared_plan(made, 2), 2)
    with pytest.raises(PlanError, match="complex"):
        shared_plan(paper_plan(GRID, 3, Size(3, 3), offset="none", correspondence="none"), 2)
    levels = made.model_copy(update={"patterns": made.patterns[5:9]})
    with pytest.raises(PlanError, match="white and black"):
        shared_plan(levels, 2)
    with pytest.raises(PlanError, match="pattern 0 is not one of"):
        plan_of_each(made)
    shared = shared_plan(made, 2)
    turned = shared.model_copy(update={"patterns": shared.patterns[1:]})
    with pytest.raises(PlanError, match="pattern 0 is not one of"):
        plan_of_each(turned)


@pytest.mark.parametrize(
    ("was", "becomes"),
    [('"inverted": [false, true]', '"inverted": [false]'), ('"projector": [8, 20]',
     '"projector": [8, 21]'), ('"kind": "cosine"', '"kind": "wave"')],
)  # fmt: skip
def test_a_damaged_file_gets_a_sentence(was, becomes):
    text = shared_plan(plan(), 2).to_json()
    assert was in text
    with pytest.raises(UnreadableFileError, match="plan"):
        parse_plan(text.replace(was, becomes))


def test_shared_photos_are_not_measured_as_those_of_one_projector():
    shared = shared_plan(plan(), 2)
    assert isinstance(shared.patterns[0], SideBySide)
    with pytest.raises(PlanError, match="several projectors at once"):
        shared.require_sinusoids("measure")
