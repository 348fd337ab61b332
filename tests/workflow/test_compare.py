"""Methods side by side on a small scene."""

import json
from dataclasses import replace
from html import escape

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.baselines.brute_force import BruteForce
from nearfar.baselines.reference import acquire_reference
from nearfar.errors import InputError
from nearfar.plan.choose import FEWEST_PHOTOS
from nearfar.report.comparison import (
    TABLE_HEAD,
    comparison_page,
    describe_failures,
    draw,
    is_comparison,
    table_rows,
    verdict,
    winners,
    write_comparison,
)
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_operator, cached_scene
from nearfar.transport.exact import ExactTransport
from nearfar.workflow.compare import compare, default_budgets, suited
from nearfar.workflow.comparison import Comparison, Trial
from nearfar.workflow.rivals import RIVALS
from nearfar.workflow.rivals.bench import Bench
from nearfar.workflow.rivals.paper import paper_plans
from nearfar.workflow.rivals.rival import Budget

BUDGETS = (40, 130)

pytestmark = pytest.mark.slow(minutes=0.5)


@pytest.fixture(scope="module")
def scene():
    # One channel and few camera pixels: methods do not mix them, and each costs as much again.
    box = cached_scene("cornell", Size(16, 16), Size(4, 4))
    return replace(box, direct=box.direct[:1], near=box.near[:1], far=box.far[:1])


@pytest.fixture(scope="module")
def found(scene) -> Comparison:
    return compare(scene, BUDGETS, window=5)


COAXIAL = {"Arnoldi", "Arnoldi after D", "symmetric"}
# Methods that stop when their patterns have nothing more to tell, which noise decides.
ADAPTIVE = {"parallel single-pixel", "adaptive dual"}


def test_every_method_has_its_trials(found):
    counts = {name: {t.photos for t in found.equal_photos if t.method == name} for name in RIVALS}
    assert counts["joint"] == set(BUDGETS)
    assert counts["CLT"] == set(BUDGETS)
    # The paper's method takes no more than it may, and needs more than 40.
    assert len(counts["paper"]) == 1
    assert 80 < min(counts["paper"]) <= 130
    assert counts["Hadamard"] == {264}
    assert counts["brute force"] == {256 + 16}
    for trial in found.equal_photos:
        assert trial.exposure == trial.photos
    for method in set(RIVALS) - COAXIAL:
        mine = [t for t in found.equal_exposure if t.method == method]
        assert [t.budget for t in mine] == [40, 130, 272]
        if method in ADAPTIVE:
            for trial in mine:
                assert trial.exposure == pytest.approx(trial.photos / 130 * trial.budget)
        else:
            assert len({t.photos for t in mine}) == 1
            np.testing.assert_allclose([t.exposure for t in mine], (40, 130, 272))
    for trial in found.equal_photos:
        assert trial.photos <= trial.budget


def test_as_much_exposure_as_photos_is_the_same_trial(found):
    for method, photos in (("joint", 130), ("CLT", 130), ("brute force", 272)):
        one, same = (
            next(t for t in trials if t.method == method and t.budget == photos)
            for trials in (found.equal_photos, found.equal_exposure)
        )
        assert one == same


@pytest.mark.parametrize(("method", "photos"), [("joint", 40), ("brute force", 272)])
def test_photos_of_one_unit_each_are_the_same_photos(scene, method, photos):
    # What lets a comparison take that trial from the one before.
    bench = Bench(scene, SimulatedCamera(), 5, 1.0)
    light = np.ones(scene.projector, dtype=np.float32)
    budgets = Budget(photos), Budget(photos, photos)
    (one,), (same,) = (RIVALS[method].attempts(bench, budget) for budget in budgets)
    np.testing.assert_array_equal(one.transport @ light, same.transport @ light)


def test_light_is_worth_decibels(found):
    for method in set(RIVALS) - COAXIAL:
        mine = [t for t in found.equal_exposure if t.method == method]
        order = sorted(mine, key=lambda t: t.exposure)
        assert order[0].white < order[-1].white


def _few(scene):
    return compare(scene, [32], methods=["joint", "CLT"], window=5).equal_photos


@pytest.fixture(scope="module")
def few(scene):
    return _few(scene)


@pytest.mark.parametrize("gain", [0.02, 50.0])
def test_the_units_of_transport_do_not_count(scene, few, gain):
    other = replace(
        scene,
        direct=tuple(gain * part for part in scene.direct),
        near=tuple(gain * part for part in scene.near),
        far=gain * scene.far,
    )
    for one, same in zip(few, _few(other), strict=True):
        assert same.pictures == pytest.approx(one.pictures, abs=1.0)


def test_more_blacks_help_brute_force_under_white(scene):
    light = np.ones(scene.projector, dtype=np.float32)
    errors = []
    for blacks in (1, 16):
        rig = SimulatedRig(scene, "box", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
        got = acquire_reference(BruteForce(scene.projector, blacks), rig)
        errors.append(np.linalg.norm(got @ light - scene @ light))
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize("projector", [Size(16, 16), Size(33, 20), Size(64, 64)])
def test_the_papers_plans_fit_and_are_the_largest(projector):
    for photos in (60, 200, 468):
        plans = paper_plans(projector, photos)
        for plan in plans:
            assert len(plan.patterns) <= photos
            assert plan.offset == "inverse"
            assert plan.correspondence == "stripes"
        assert len({(plan.window, plan.far) for plan in plans}) == len(plans)
    assert paper_plans(projector, sum(projector)) == []


def test_the_default_budgets_end_with_the_papers_photos():
    assert default_budgets(Size(64, 64)) == (29, 58, 117, 234, 468)
    assert min(default_budgets(Size(16, 16))) >= FEWEST_PHOTOS


@pytest.mark.parametrize(
    ("budgets", "methods", "said"),
    [
        ([5, 100], None, "too small"),
        ([], None, "too small"),
        ([60], ["magic"], "no method magic"),
        ([60], [], "no method"),
    ],
)
def test_what_cannot_be_compared_is_said(scene, budgets, methods, said):
    with pytest.raises(InputError, match=said):
        compare(scene, budgets, methods=methods)


def test_methods_that_need_matrices_are_named_where_there_are_none():
    world = cached_operator("corner", Size(20, 20), Size(18, 15))
    found = compare(world, [60], methods=["CLT", "joint", "Hadamard", "brute force"])
    assert {trial.method for trial in found.equal_photos} == {"joint"}
    assert found.equal_photos[0].pictures > 25
    assert {failure.method for failure in found.failures} == {"CLT", "Hadamard", "brute force"}
    assert all("corner" in failure.reason for failure in found.failures)
    assert all("`projector`" in failure.reason for failure in found.failures)


def test_methods_that_the_scene_does_not_suit_are_left_out_by_name(found):
    # 4 x 4 camera pixels for 16 x 16.
    assert {method for method, _ in found.left_out} == COAXIAL
    assert not found.failures
    said = describe_failures(found)
    assert len(said) == len(COAXIAL)
    assert said[0] == (
        "optical Arnoldi is left out: it needs a coaxial camera with the projector's pixels, and "
        "that of cornell has 4x4 for 16x16."
    )
    assert found.numbers()["left_out"][0]["method"] == "Arnoldi"
    page = comparison_page(found)
    for method in RIVALS:
        assert escape(RIVALS[method].assumes) in page
    assert escape(said[0]) in page


def _without_photos(name, *sizes):
    box = cached_scene(name, *sizes)
    return replace(box, direct=box.direct[:1], near=box.near[:1], far=box.far[:1])


def test_a_camera_that_stands_aside_is_seen_by_its_transport():
    aside = _without_photos("cornell-aside", Size(8, 8), Size(8, 8))
    with pytest.raises(InputError, match=r"no method is left.*stands aside.*Name others"):
        compare(aside, [24], methods=["Arnoldi", "symmetric"])
    assert suited(aside, ["Arnoldi", "CLT"])[0] == ("CLT",)
    coaxial = _without_photos("cornell", Size(8, 8), Size(8, 8))
    assert suited(coaxial, list(RIVALS)) == (tuple(RIVALS), ())
    # Of an operator too, which has no matrix to transpose.
    corner = cached_operator("corner", Size(8, 8), Size(8, 8))
    assert suited(corner, ["Arnoldi"]) == (("Arnoldi",), ())


def test_methods_of_a_coaxial_camera_are_tried_before_one():
    coaxial = _without_photos("cornell", Size(8, 8), Size(8, 8))
    found = compare(coaxial, [30], methods=sorted(COAXIAL))
    assert {(trial.method, trial.photos) for trial in found.equal_photos} == {
        (method, 30) for method in COAXIAL
    }
    assert min(trial.pictures for trial in found.equal_photos) > 5
    labels = [text.get_text() for text in draw(found).legends[0].get_texts()]
    assert labels == ["optical Arnoldi", "optical Arnoldi, D first", "symmetric"]


def test_the_page_holds_every_trial(found, tmp_path):
    folder = tmp_path / "comparison"
    write_comparison(folder, found)
    assert is_comparison(folder)
    assert {path.name for path in folder.iterdir()} == {
        "index.html", "comparison.png", "comparison.pdf", "comparison.json",
    }  # fmt: skip
    data = json.loads((folder / "comparison.json").read_text())
    assert len(data["equal_photos"]) == len(found.equal_photos)
    text = comparison_page(found)
    for row in table_rows(found.equal_photos) + table_rows(found.equal_exposure):
        assert len(row) == len(TABLE_HEAD)
        assert f"<td>{row[3]}</td>" in text
    assert verdict(found) in text
    # At equal photos Hadamard and brute force are alone with theirs, and best of nobody.
    best = [row for row in table_rows(found.equal_photos) if row[-1]]
    assert sorted(", ".join(row[-1] for row in best).split(", ")) == ["130", "40"]
    best += [row for row in table_rows(found.equal_exposure) if row[-1]]
    assert text.count('<tr class="best">') == len(best)
    for budget in BUDGETS:
        rivals = [trial for trial in found.equal_photos if trial.budget == budget]
        highest = f"{max(trial.pictures for trial in rivals):.1f}"
        assert next(row[3] for row in best if str(budget) in row[-1].split(", ")) == highest
    (folder / "mine.txt").write_text("kept")
    assert not is_comparison(folder)


def test_the_winner_is_the_best_that_was_measured():
    trials = [
        # The paper's plan leaves some of its photos.
        Trial("paper", 100, 94, 94.0, 40.0, 50.0, 45.0),
        Trial("joint", 100, 100, 100.0, 39.0, 60.0, 50.0),
        Trial("CLT", 50, 50, 50.0, 20.0, 30.0, 25.0),
    ]
    assert winners(trials) == [
        "50: compressive (CLT) 20.0 dB",
        "100: the paper's 40.0 dB, then joint, no stripes 39.0 dB",
    ]


def test_a_projector_of_one_row_is_compared_by_what_fits():
    generator = np.random.default_rng(2)
    matrix = generator.uniform(size=(6, 16)).astype(np.float32) / 16
    row = ExactTransport(Size(1, 16), Size(2, 3), (), (), matrix[None], "a row")
    found = compare(row, [30], methods=["joint", "Hadamard", "brute force"])
    assert {trial.method for trial in found.equal_photos} == {"joint", "Hadamard", "brute force"}
    assert not found.failures
    assert min(trial.pictures for trial in found.equal_photos) > 15
    assert default_budgets(row.projector)


def test_compressive_tells_how_long_it_will_take_and_how_far_it_is(monkeypatch):
    monkeypatch.setattr("nearfar.workflow.rivals.compressive.FEWEST_TO_ESTIMATE", 1)
    monkeypatch.setattr("nearfar.workflow.rivals.compressive.SECONDS_TO_ANNOUNCE", 0.0)
    generator = np.random.default_rng(2)
    matrix = generator.uniform(size=(24, 64)).astype(np.float32) / 64
    scene = ExactTransport(Size(8, 8), Size(4, 6), (), (), matrix[None], "noise")
    notes, told, kept = [], [], []
    found = compare(
        scene,
        [24],
        methods=["CLT"],
        note=notes.append,
        progress=lambda what, share: told.append((what, share)),
        on_trial=kept.append,
    )
    assert len(notes) == 2
    assert "compressive (CLT), 24 photos: choosing the regularisation has taken" in notes[0]
    assert "compressive (CLT), 24 photos: the Lasso of 24 rows takes about" in notes[1]
    shares = [share for what, share in told if what == "compressive (CLT)"]
    assert shares == sorted(shares)
    assert shares[0] == 0.0
    assert shares[-1] == 1.0
    assert len(set(shares)) > 5
    assert [comparison.is_finished for comparison in kept] == [False, True]
    assert kept[-1] == found


def test_a_camera_much_coarser_than_the_projector_is_relit_as_well():
    """Each camera pixel sees 10 x 10 projector pixels."""
    corner = cached_operator("corner", Size(136, 150), Size(14, 15))
    (trial,) = compare(corner, [100], methods=["joint"]).equal_photos
    # Less than was measured by 5 dB; with places of footprints of a pixel or two 10 dB.
    assert trial.pictures > 37
