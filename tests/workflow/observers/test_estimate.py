"""Transports that are made while the photos are taken."""

import threading
import time
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_stripes
from nearfar.errors import InputError, PlanError
from nearfar.illumination.pictures import standard_lights
from nearfar.photometry.measure import measure, measured_basis
from nearfar.plan import choose_plan, paper_plan
from nearfar.plan.checks import ends
from nearfar.progress import ignore_progress
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.acquire import acquire, acquire_in_memory
from nearfar.workflow.evaluate import relighting_snr
from nearfar.workflow.observers import estimate as observing
from nearfar.workflow.observers.estimate import EstimateObserver
from nearfar.workflow.reconstruction.executors import SerialExecutor, execute
from nearfar.workflow.reconstruction.job import ReconstructedTile
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from nearfar.workflow.reconstruction.reconstruct import reconstruct
from nearfar.workflow.reconstruction.sinks import MemorySink
from tests.observers import EndsWhere
from tests.plans import chosen_plan
from tests.waiting import LONGEST_WAIT
from tests.workflow.reconstruction.memory import memory_for
from tests.worlds import model_transport

SIZE = Size(32, 32)
PAIRS = partial(paper_plan, SIZE, 8, Size(5, 5))
# Made when they are asked for: choosing one takes as long as some tests.
MAKERS = {
    "reference": lambda: chosen_plan(SIZE, 120),
    "pairs": partial(PAIRS, correspondence="none"),
    "pairs and stripes": PAIRS,
    "reference and stripes": partial(PAIRS, offset="reference"),
}

pytestmark = pytest.mark.slow


@cache
def _plan(name):
    return MAKERS[name]()


@pytest.fixture(scope="module")
def scene():
    return cached_scene("cornell", SIZE)


@pytest.fixture
def rig(scene):
    return _rig(scene)


def _rig(scene):
    return SimulatedRig(scene, "cornell", SimulatedProjector(), SimulatedCamera(), 1.0, 0)


@pytest.fixture(scope="module")
def afterwards(scene, tmp_path_factory):
    """Return what is reconstructed after a capture by a plan; nobody writes to it.

    Every capture of these tests by one plan has the same photos, for they have one seed.
    """

    @cache
    def reconstructed(plan):
        path = tmp_path_factory.mktemp("afterwards") / "c.zarr"
        return reconstruct(acquire(_plan(plan), path, _rig(scene)))

    return reconstructed


class Patient(EstimateObserver):
    """Waits for what is done beside the capture, as slow photos would."""

    def after_photo(self, number, photo):
        super().after_photo(number, photo)
        if self._pending_choice is not None:
            self._pending_choice.exception()

    def _ends_in_time(self, taken):
        # The photo after one that is not the last is always slow enough.
        return taken < len(self._plan.patterns)


def _follow(plan, rig, path):
    with Patient(plan, rig.full_scale) as estimate:
        capture = acquire(plan, path, rig, observers=[estimate])
        return _made(estimate, capture), estimate, capture


def _made(estimate, capture):
    """Transport and correspondence of a capture that was followed."""
    sink = MemorySink()
    execute(estimate.finish(capture), SerialExecutor(), sink, ignore_progress)
    return ReconstructedTile(*sink.collected())


def _timeless(provenance):
    """Leave out when the photos were taken."""
    photos = {name: value for name, value in provenance["photos"].items() if name != "taken"}
    return {**provenance, "photos": photos}


@pytest.mark.parametrize("plan", ["reference", "pairs", "pairs and stripes"])
def test_the_transport_is_as_good_as_if_made_afterwards(scene, rig, afterwards, tmp_path, plan):
    part, estimate, _ = _follow(_plan(plan), rig, tmp_path / "c.zarr")
    expected, correspondence = afterwards(plan)
    assert 0 < estimate.chosen_by < len(_plan(plan).patterns)
    np.testing.assert_array_equal(part.correspondence.q, correspondence.q)
    assert _timeless(part.transport.provenance) == _timeless(expected.provenance)
    lights = standard_lights(SIZE)
    found, best = (relighting_snr(t, scene, lights) for t in (part.transport, expected))
    assert min(found[name] - best[name] for name in lights) > -0.5
    assert np.mean([found[name] - best[name] for name in lights]) > -0.15


def test_components_are_those_of_the_early_choice(rig, tmp_path):
    part, estimate, _ = _follow(_plan("reference"), rig, tmp_path / "c.zarr")
    chosen = estimate._choice.components.of_error_bars
    np.testing.assert_array_equal(
        part.transport.posterior.prior_component.ravel(), chosen.prior_component
    )
    np.testing.assert_array_equal(part.transport.posterior.prior_scale.ravel(), chosen.prior_scale)


def test_components_of_pixels_that_turn_out_unlit_are_chosen_again(rig, tmp_path, monkeypatch):
    plan = _plan("pairs and stripes")
    dark = (3, 4)

    def unlit(photos, _measurements, rows):
        found = correspond_by_stripes(photos, rows)
        found.q[dark] = np.nan
        return found

    monkeypatch.setattr("nearfar.workflow.reconstruction.sources.find_correspondence", unlit)
    part, estimate, capture = _follow(plan, rig, tmp_path / "c.zarr")
    assert estimate.chosen_by > 0
    expected, _ = reconstruct(capture)
    kind = part.transport.posterior.prior_component
    assert kind[dark] == expected.posterior.prior_component[dark]
    assert kind[dark] > kind[:3].max()
    np.testing.assert_array_equal(part.transport.near[dark], 0)


def test_photos_that_come_too_fast_are_estimated_from_all_the_same(
    rig, afterwards, tmp_path, monkeypatch
):
    monkeypatch.setattr(EstimateObserver, "_is_time", lambda *_: False)
    part, estimate, _ = _follow(_plan("reference"), rig, tmp_path / "c.zarr")
    assert estimate.chosen_by == 0
    expected, _ = afterwards("reference")
    for name in ("direct", "near", "far"):
        np.testing.assert_array_equal(getattr(part.transport, name), getattr(expected, name))


def test_photos_that_do_not_fit_are_read_again_in_blocks(rig, tmp_path):
    plan = _plan("reference")
    memory = memory_for(9, plan, SIZE, "joint")
    with Patient(plan, rig.full_scale, ReconstructionOptions(memory=memory)) as estimate:
        capture = acquire(plan, tmp_path / "c.zarr", rig, observers=[estimate])
        work = estimate.finish(capture)
        part = _made(estimate, capture)
    assert estimate.photos is None
    assert work.tiling.rows < SIZE.height
    expected, _ = reconstruct(capture, memory=memory)
    np.testing.assert_array_equal(part.transport.near, expected.near)


def test_memory_for_no_row_is_refused_with_the_first_photo(rig, tmp_path):
    with (
        pytest.raises(InputError, match="`memory="),
        EstimateObserver(
            _plan("reference"), rig.full_scale, ReconstructionOptions(memory=10**6)
        ) as estimate,
    ):
        acquire(_plan("reference"), tmp_path / "c.zarr", rig, observers=[estimate])
    assert list(tmp_path.iterdir()) == []


def test_a_capture_that_ends_early_is_estimated_from_what_there_is(rig, tmp_path):
    plan, _ = choose_plan(SIZE, 120, checks=0)
    end = next(end for end in ends(plan) if end > 0.6 * len(plan.patterns))
    with Patient(plan, rig.full_scale) as estimate:
        capture = acquire(
            plan,
            tmp_path / "c.zarr",
            rig,
            observers=[estimate, EndsWhere(lambda n, _photo: n + 1 == end)],
        )
        part = _made(estimate, capture)
    assert len(capture.plan.patterns) == end
    # Components were chosen from enough of the photos that there are.
    assert observing.SUFFICIENT_SHARE * end < estimate.chosen_by < end
    expected, _ = reconstruct(capture)
    assert part.transport.provenance == expected.provenance


def test_components_from_too_few_photos_are_chosen_again(rig, afterwards, tmp_path, monkeypatch):
    # Photos come too fast for more than the first choice, by half of them.
    monkeypatch.setattr(Patient, "_ends_in_time", lambda *_: False)
    part, estimate, _ = _follow(_plan("reference"), rig, tmp_path / "c.zarr")
    assert estimate._choice is not None
    assert estimate.chosen_by == 0
    expected, _ = afterwards("reference")
    np.testing.assert_array_equal(part.transport.near, expected.near)


def test_a_small_camera_has_no_early_choice(tmp_path):
    world = model_transport(SIZE, Size(1, 1), window=5, far=Size(3, 3), channels=1)
    rig = SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    for plan in ("reference", "pairs"):
        part, estimate, capture = _follow(_plan(plan), rig, tmp_path / f"{plan}.zarr")
        assert estimate._choice is None
        expected, _ = reconstruct(capture)
        np.testing.assert_array_equal(part.transport.near, expected.near)


def test_a_fault_of_the_work_beside_costs_no_photo(rig, tmp_path, monkeypatch):
    def faulty(*_arguments, **_options):
        raise RuntimeError("out of memory")

    monkeypatch.setattr(observing, "choose_components", faulty)
    plan = _plan("reference")
    with Patient(plan, rig.full_scale) as estimate:
        capture = acquire(plan, tmp_path / "c.zarr", rig, observers=[estimate])
        assert len(capture.plan.patterns) == len(plan.patterns)
        with pytest.raises(RuntimeError, match="out of memory"):
            _made(estimate, capture)


def test_a_pending_choice_ends_with_the_capture(rig, tmp_path, monkeypatch):
    begun, before = threading.Event(), threading.active_count()

    def endless(*_arguments, progress, **_options):
        begun.set()
        while True:
            time.sleep(0.01)
            progress(0.0)

    monkeypatch.setattr(observing, "choose_components", endless)

    def stop(number, _photo):
        if number > 80 and begun.wait(LONGEST_WAIT):
            raise KeyboardInterrupt

    with (
        pytest.raises(KeyboardInterrupt),
        EstimateObserver(_plan("reference"), rig.full_scale) as estimate,
    ):
        observers = [estimate, EndsWhere(stop)]
        acquire(_plan("reference"), tmp_path / "c.zarr", rig, observers=observers)
    assert begun.is_set()
    assert [path.name for path in tmp_path.iterdir()] == ["c.zarr.unfinished"]
    assert threading.active_count() <= before + 1


def test_photos_that_cannot_be_measured_are_kept(rig, tmp_path):
    # White stands at full scale everywhere, which the references tell.
    bright = replace(rig, exposure=1e3)
    with Patient(_plan("reference"), rig.full_scale) as estimate:
        capture = acquire(_plan("reference"), tmp_path / "c.zarr", bright, observers=[estimate])
        with pytest.raises(InputError, match="full scale"):
            _made(estimate, capture)
    assert estimate.chosen_by == 0
    np.testing.assert_array_equal(
        capture.read([0]), acquire_in_memory(_plan("reference"), bright).read([0], slice(None))
    )


@pytest.mark.parametrize("options", [{"method": "paper"}, {"square": True}])
def test_options_that_it_would_not_follow_are_refused(options):
    with pytest.raises(InputError, match="while capturing, only"):
        EstimateObserver(_plan("reference"), 1.0, ReconstructionOptions(**options))


def test_complex_patterns_are_refused():
    with pytest.raises(PlanError):
        EstimateObserver(paper_plan(SIZE, 8, Size(5, 5), offset="none"), 1.0)


@pytest.mark.parametrize("plan", MAKERS)
def test_a_plan_may_end_where_its_first_photos_can_be_measured(rig, plan):
    whole = _plan(plan)
    photos = acquire_in_memory(whole, rig)
    found = ends(whole)
    stripes = [i for i, pattern in enumerate(whole.patterns) if pattern.purpose == "correspondence"]
    assert len(found) > 4
    for end in range(1, len(whole.patterns) + 1):
        part = replace(photos, plan=whole.first(end), photos=photos.photos[:end])
        among = bool(stripes) and stripes[0] < end <= stripes[-1]
        if end in found:
            assert not among
            measure(part, slice(0, 1))
        elif whole.offset == "inverse" and not among:
            with pytest.raises(InputError):
                measure(part, slice(0, 1))


@pytest.mark.parametrize("plan", MAKERS)
def test_what_is_measured_is_known_before(rig, plan):
    basis, multiplicity = measured_basis(_plan(plan))
    measurements = measure(acquire_in_memory(_plan(plan), rig), slice(0, 1))
    assert basis.frequencies == measurements.basis.frequencies
    np.testing.assert_array_equal(multiplicity, measurements.multiplicity)
