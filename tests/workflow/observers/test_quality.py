"""Captures that end at a target SNR, and what limits those that do not reach it."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import Decision, open_capture
from nearfar.errors import InputError, PlanError
from nearfar.plan import paper_plan, parse_plan
from nearfar.plan.checks import (
    check_lights,
    ends,
    is_reference,
    with_checks,
)
from nearfar.plan.patterns import Picture
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.acquire import acquire
from nearfar.workflow.evaluate import snr
from nearfar.workflow.observers.quality import QualityObserver, choose_rows
from nearfar.workflow.reconstruction.reconstruct import reconstruct
from tests.plans import chosen_plan

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def scene():
    return cached_scene("cornell", Size(32, 32))


def _rig(scene, **camera):
    return SimulatedRig(scene, "cornell", SimulatedProjector(), SimulatedCamera(**camera), 1.0, 0)


def _run(scene, path, photos, target, **camera):
    plan = with_checks(chosen_plan(scene.projector, photos))
    rig = _rig(scene, **camera)
    qualities = []
    check = QualityObserver(plan, target, rig.full_scale, qualities.append)
    capture = acquire(plan, path, rig, observers=[check])
    return plan, capture, qualities


def test_a_capture_ends_when_it_is_good_enough_and_is_whole(scene, tmp_path):
    plan, capture, qualities = _run(scene, tmp_path / "c.zarr", 150, 39.0)
    assert len(capture.plan.patterns) < len(plan.patterns)
    assert qualities[-1].snr >= 39.0
    assert all(quality.snr < 39.0 for quality in qualities[:-1])
    assert qualities[-1].photos == len(capture.plan.patterns) == capture.photos.shape[0]
    # On the disk it is a capture like any other.
    again = open_capture(tmp_path / "c.zarr")
    assert again.plan == plan.first(qualities[-1].photos)
    transport, _ = reconstruct(again)
    # What was said is what the estimate does under pictures that it never saw.
    values = []
    for check in check_lights(plan):
        light = plan.draw(check.photos[0]) / np.float32(255)
        values.append(snr(scene @ light, transport @ light))
    assert np.mean(values) == pytest.approx(qualities[-1].snr, abs=1.0)


def test_the_check_is_not_fooled_by_noise(scene, tmp_path):
    # The photos of the checks are far noisier than the SNR of the estimate.
    _, capture, qualities = _run(scene, tmp_path / "c.zarr", 150, 90.0, full_well=1000.0)
    transport, _ = reconstruct(capture)
    values = []
    for check in check_lights(capture.plan):
        light = capture.plan.draw(check.photos[0]) / np.float32(255)
        values.append(snr(scene @ light, transport @ light))
    assert np.mean(values) == pytest.approx(qualities[-1].snr, abs=1.0)
    assert qualities[-1].photos == len(capture.plan.patterns)
    assert qualities[-1].limit == "noise"


def test_too_few_photos_are_the_limit(scene, tmp_path):
    _, _, qualities = _run(scene, tmp_path / "c.zarr", 30, 90.0, full_well=3e7)
    assert qualities[-1].limit == "photos"


def test_a_scene_outside_the_model_is_the_limit(tmp_path):
    # Rows of pure chance: no direct light, window or band holds them.
    projector = Size(16, 16)
    generator = np.random.default_rng(0)
    base = cached_scene("cornell", projector)
    rough = replace(base, far=base.far + 2e-3 * generator.random(base.far.shape, dtype=np.float32))
    _, _, qualities = _run(rough, tmp_path / "c.zarr", 120, 90.0, full_well=3e6)
    assert qualities[-1].limit == "model"
    assert qualities[-1].snr < 35


def test_photos_that_cannot_be_measured_end_a_capture_early_and_later_ones_do_not(scene, tmp_path):
    # White is at full scale from the start.
    bright = replace(scene, far=scene.far + 1.0)
    with pytest.raises(InputError, match="full scale"):
        _run(bright, tmp_path / "c.zarr", 150, 90.0)
    assert not (tmp_path / "c.zarr").exists()
    # The lamp fails after the first look: every photo is asked for all the same.
    plan = with_checks(chosen_plan(scene.projector, 60))
    rig = _rig(scene)
    qualities = []
    check = QualityObserver(plan, 90.0, rig.full_scale, qualities.append)
    shown = (plan.draw(i) for i in range(len(plan.patterns)))
    for number, photo in enumerate(rig.shoot(shown)):
        failed = qualities and number < len(plan.patterns)
        decision = check.after_photo(number, np.zeros_like(photo) if failed else photo)
        assert decision is Decision.CONTINUE
    assert qualities[0].fault is None
    assert qualities[-1].fault.endswith(".")
    assert qualities[-1].photos == len(plan.patterns)


def test_estimates_are_rarer_the_farther_the_target(scene, tmp_path):
    _, _, far = _run(scene, tmp_path / "far.zarr", 100, 90.0)
    _, _, close = _run(scene, tmp_path / "close.zarr", 100, 40.6)
    assert len(far) < len(close)


def test_checks_stand_behind_the_first_references_with_their_inverses():
    plan = chosen_plan(Size(16, 20), 60)
    checked = with_checks(plan)
    # The plan's own picture is the first of the three.
    assert plan.counts["check"] == 2
    assert checked.counts["check"] == 6
    assert len(checked.patterns) == len(plan.patterns) + 4
    lights = check_lights(checked)
    assert [light.pattern for light in lights] == [Picture(seed=seed) for seed in (101, 102, 103)]
    assert all(len(light.photos) == len(light.inverses) == 1 for light in lights)
    first = min(light.photos[0] for light in lights)
    assert all(is_reference(pattern) for pattern in checked.patterns[:first])
    others = [tuple(p for p in each.patterns if p.purpose != "check") for each in (plan, checked)]
    assert others[0] == others[1]
    assert parse_plan(checked.to_json()) == checked
    assert with_checks(checked) == checked
    assert checked.draw(first).std() > 10


@pytest.mark.parametrize("photos", [40, 61, 100, 150])
@pytest.mark.parametrize("side", [16, 24])
def test_a_plan_may_end_whenever_white_and_black_come_by(side, photos):
    plan = with_checks(chosen_plan(Size(side, side), photos))
    found = ends(plan)
    places = [
        i + 1
        for i, pattern in enumerate(plan.patterns)
        if is_reference(pattern)
        and (i + 1 == len(plan.patterns) or not is_reference(plan.patterns[i + 1]))
    ]
    assert found == places[1:]
    for end in found:
        kinds = {}
        for pattern in plan.first(end).patterns:
            if pattern.purpose not in {"check", "reference"}:
                kinds.setdefault(pattern.frequency, set()).add(pattern.kind)
        assert all(len(kind) == 1 + (not k.is_own_negative) for k, kind in kinds.items())


def test_a_plan_of_pairs_or_stripes_is_refused():
    for offset, by in (("inverse", "none"), ("reference", "stripes")):
        plan = paper_plan(Size(16, 20), 5, Size(3, 3), offset=offset, correspondence=by)
        with pytest.raises(PlanError, match="`photos`"):
            with_checks(plan)


@pytest.mark.parametrize(
    ("height", "width"), [(4, 9), (64, 64), (1000, 2000), (3000, 12), (7, 9000)]
)
def test_chosen_rows_are_few_and_spread(height, width):
    rows = choose_rows(height, width)
    assert len(np.unique(rows)) == len(rows)
    assert rows.min() >= 0
    assert rows.max() < height
    assert len(rows) * width <= max(6144, 8 * width)
    assert len(rows) >= min(height, 8)
    if len(rows) < height and len(rows) > 8:
        assert rows.max() - rows.min() > 0.6 * height
