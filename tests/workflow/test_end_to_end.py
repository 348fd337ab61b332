"""From a plan to a relit picture, by the Python interface."""

import json
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.correspondence import correspond_by_gray_code, given_correspondence
from nearfar.errors import InputError, PlanError
from nearfar.illumination.pictures import natural_picture
from nearfar.plan import choose_plan, paper_plan
from nearfar.rigs.opening import open_rig
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.drift import SimulatedDrift
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.transport.rows import FACTORS, POSTERIOR_FIELDS, of_rows
from nearfar.transport.store import load_transport
from nearfar.transport.store_writing import write_transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.evaluate import relighting_snr, snr
from nearfar.workflow.judge import judge_by_truth
from nearfar.workflow.reconstruction import reconstruct as reconstruction
from nearfar.workflow.reconstruction.job import tiling_of
from nearfar.workflow.reconstruction.options import ReconstructionOptions
from tests.conftest import QUIET
from tests.estimate.test_fit import _exact_of
from tests.plans import chosen_plan
from tests.workflow.reconstruction.memory import memory_for
from tests.worlds import model_transport

reconstruct = partial(reconstruction.reconstruct, method="paper")

PROJECTOR = Size(24, 30)
PLAN = paper_plan(PROJECTOR, 7, Size(3, 3))
BY_REFERENCE = paper_plan(PROJECTOR, 7, Size(3, 3), offset="reference")


def _rig(world, camera=QUIET):
    return SimulatedRig(world, "test", SimulatedProjector(), camera, 1.0, 0)


@pytest.fixture(scope="module")
def world():
    """A transport that obeys the model; nothing writes to it."""
    return model_transport(
        PROJECTOR, Size(24, 30), window=7, far=Size(3, 3), channels=3
    ).with_gains(near=0.2)


@pytest.fixture(scope="module")
def captured(world, tmp_path_factory):
    """Return a capture of the world by a plan, taken once: one seed gives the same photos.

    Nothing writes to its folder.
    """

    @cache
    def taken(plan, camera=QUIET):
        return acquire(plan, tmp_path_factory.mktemp("capture") / "c.zarr", _rig(world, camera))

    return taken


@pytest.fixture(scope="module")
def by_chosen_plan(captured):
    """Return a plan of few photos, its capture, and what is reconstructed with some memory."""
    plan = chosen_plan(PROJECTOR, 60, window=7)
    capture = captured(plan, SimulatedCamera())
    return plan, capture, cache(partial(reconstruction.reconstruct, capture))


@pytest.fixture(scope="module")
def captured_finer(tmp_path_factory):
    """The transport of a camera twice as fine as the projector, and a capture of it."""
    fine = model_transport(PROJECTOR, Size(48, 60), window=7, far=Size(3, 3)).with_gains(near=0.1)
    return fine, acquire(PLAN, tmp_path_factory.mktemp("finer") / "c.zarr", _rig(fine))


def test_a_clean_capture_of_a_model_world_relights_it(captured, world):
    capture = captured(PLAN)
    transport, correspondence = reconstruct(capture)
    assert correspondence.lit.all()
    light = nearfar.natural_picture(PROJECTOR, 1, colour=True)
    # Photos of 16 bits: a rounding of 1/65535 in each, on responses of a few tenths.
    assert snr(world @ light, transport @ light) > 55
    np.testing.assert_allclose(transport.black, 0.03, atol=1e-4)


def test_more_noise_makes_it_worse_and_none_makes_it_exact(captured, world):
    light = nearfar.natural_picture(PROJECTOR, 2)
    found = []
    for camera in (SimulatedCamera(full_well=1000), SimulatedCamera(), QUIET):
        given = given_correspondence(world.correspondence, world.camera, PROJECTOR)
        transport, _ = reconstruct(captured(PLAN, camera), given)
        found.append(snr(world @ light, transport @ light))
    assert found[0] + 8 < found[1] < found[2]
    assert found[2] > 65


def test_blocks_of_rows_change_next_to_nothing(captured):
    capture = captured(PLAN, SimulatedCamera())
    whole, _ = reconstruct(capture)
    parts, _ = reconstruct(capture, memory=memory_for(12, PLAN, PROJECTOR))
    # The noise model is fitted in each block on its own: what differs is far below the noise.
    for name in ("direct", "far", "near"):
        one, other = getattr(parts, name), getattr(whole, name)
        assert one.shape == other.shape
        assert np.sqrt(np.mean((one - other) ** 2)) < 0.2 * whole.noise.mean()
    np.testing.assert_allclose(parts.noise, whole.noise, rtol=0.05)


def test_a_dark_margin_is_no_fault(tmp_path, world):
    q = world.correspondence.copy()
    q[:12] = np.nan
    dark = replace(
        world,
        correspondence=q,
        **{
            name: np.concatenate([0 * getattr(world, name)[:12], getattr(world, name)[12:]])
            for name in ("direct", "near", "far")
        },
    )
    camera = SimulatedCamera(black_level=0.0, ambient=0.0, read_noise=0.0)
    capture = acquire(PLAN, tmp_path / "c.zarr", _rig(dark, camera))
    memory = memory_for(6, PLAN, PROJECTOR)
    transport, correspondence = reconstruct(capture, memory=memory)
    np.testing.assert_array_equal(correspondence.lit, np.isfinite(q[..., 0]))
    assert np.all(np.isfinite(transport.near))
    light = nearfar.natural_picture(PROJECTOR, 1)
    assert np.all((transport @ light)[:12] == 0)
    assert snr(dark @ light, transport @ light) > 35
    # What counts as dark does so beside the whole camera, not beside the dark rows alone.
    parts, _ = reconstruct(capture, method="joint", memory=memory_for(5, PLAN, PROJECTOR, "joint"))
    whole, _ = reconstruct(capture, method="joint")
    np.testing.assert_array_equal(parts.posterior.white[:12], whole.posterior.white[:12])
    assert whole.posterior.white[:12].min() > 0


def test_correspondence_can_be_given(captured, world):
    plan = paper_plan(PROJECTOR, 7, Size(3, 3), correspondence="none")
    capture = captured(plan)
    given = given_correspondence(world.correspondence, world.camera, PROJECTOR)
    transport, _ = reconstruct(capture, given)
    light = nearfar.random_pattern(PROJECTOR, 1)
    assert snr(world @ light, transport @ light) > 60


def test_a_camera_twice_as_fine_keeps_its_own_resolution(tmp_path):
    fine = model_transport(
        PROJECTOR, Size(48, 60), window=7, far=Size(3, 3), fractional=True
    ).with_gains(near=0.1)
    transport, _ = reconstruct(acquire(PLAN, tmp_path / "c.zarr", _rig(fine)))
    assert transport.camera == Size(48, 60)
    light = nearfar.natural_picture(PROJECTOR, 3)
    assert (transport @ light).shape == (48, 60)
    assert snr(fine @ light, transport @ light) > 40


def test_the_square_transport_has_the_projectors_size(captured_finer):
    fine, capture = captured_finer
    transport, correspondence = reconstruct(capture, square=True)
    assert transport.camera == PROJECTOR
    assert correspondence.q.shape == (48, 60, 2)
    light = nearfar.natural_picture(PROJECTOR, 1)
    picture, q = fine @ light, np.rint(correspondence.q).astype(int)
    for y, x in ((3, 4), (12, 20)):
        mine = (q == (y, x)).all(axis=-1)
        assert (transport @ light)[y, x] == pytest.approx(picture[mine].mean(), rel=2e-3)


def test_a_plan_that_is_not_the_papers_is_refused(tmp_path, world):
    patterns = tuple(p for p in PLAN.patterns if p.purpose != "direct")
    capture = acquire(
        PLAN.model_copy(update={"patterns": patterns}), tmp_path / "c.zarr", _rig(world)
    )
    with pytest.raises(PlanError, match="not the paper's"):
        reconstruct(capture)


def test_a_capture_by_reference_relights_as_well(captured, world):
    capture = captured(BY_REFERENCE)
    transport, correspondence = reconstruct(capture)
    assert correspondence.lit.all()
    light = nearfar.natural_picture(PROJECTOR, 1, colour=True)
    assert snr(world @ light, transport @ light) > 55
    np.testing.assert_allclose(transport.black, 0.03, atol=1e-4)
    assert transport.provenance["drift"]["lamp"] < 1e-4
    assert transport.provenance["drift"]["ambient"] < 1e-4


def test_drift_is_taken_out_told_and_kept_from_stripes(tmp_path, captured, world):
    drift = SimulatedDrift(per_100_photos=-0.15)
    camera = SimulatedCamera(ambient_drift=SimulatedDrift(per_100_photos=2.0))
    moved = replace(_rig(world, camera), optics=SimulatedProjector(lamp_drift=drift))
    captures = {
        "still": captured(BY_REFERENCE, SimulatedCamera()),
        "moved": acquire(BY_REFERENCE, tmp_path / "c.zarr", moved),
    }
    light, found = nearfar.natural_picture(PROJECTOR, 1), {}
    for name, capture in captures.items():
        transport, correspondence = reconstruct(capture)
        assert correspondence.lit.all()
        gain = np.vdot(world @ light, transport @ light) / np.vdot(world @ light, world @ light)
        found[name] = snr(gain * (world @ light), transport @ light)
    # The lamp gets darker and the ambient light brighter, so there is more noise as well.
    assert found["moved"] > found["still"] - 1.0
    photos = len(BY_REFERENCE.patterns)
    expected = 0.15 * photos / 100 / (1 - 0.15 * photos / 200)
    assert transport.provenance["drift"]["lamp"] == pytest.approx(expected, rel=0.1)


def test_blocks_of_rows_change_nothing_by_reference(captured):
    capture = captured(BY_REFERENCE, SimulatedCamera())
    whole, _ = reconstruct(capture)
    memory = memory_for(5, BY_REFERENCE, PROJECTOR)
    parts, _ = reconstruct(capture, memory=memory)
    # Drift and noise are those of the whole camera; matrix products round by blocks.
    for name in ("direct", "far", "near", "noise", "black"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), atol=2e-5)


@pytest.mark.parametrize("given", [False, True])
def test_blocks_of_rows_change_nothing_for_neighbours(by_chosen_plan, world, given):
    plan, capture, reconstructed = by_chosen_plan
    if given:
        known = given_correspondence(world.correspondence, world.camera, PROJECTOR)
        reconstructed = partial(reconstruction.reconstruct, capture, known)
    whole, q = reconstructed()
    # With those beside them, more rows would be all 24 at once.
    for rows in (5, 3):
        memory = memory_for(rows, plan, PROJECTOR, "joint")
        options = ReconstructionOptions(memory=memory)
        tiles = list(tiling_of(capture, options, given=given).tiles())
        assert len(tiles) == -(-24 // rows)
        parts, found = reconstructed(memory=memory)
        np.testing.assert_array_equal(found.lit, q.lit)
        # Matrix products round by blocks, and a camera pixel between two kinds may take the other.
        same = parts.posterior.prior_component == whole.posterior.prior_component
        assert same.mean() > 0.99
        for name in ("correspondence", "direct", "near", "far", "noise", "black"):
            one, other = getattr(parts, name), getattr(whole, name)
            assert np.mean(np.abs(one - other) > 1e-4) < 0.01, name


def test_blocks_go_to_the_disk_as_the_whole_does(tmp_path, by_chosen_plan):
    plan, capture, reconstructed = by_chosen_plan
    memory = memory_for(5, plan, PROJECTOR, "joint")
    options = ReconstructionOptions(memory=memory)
    reconstruction.reconstruct_to_file(capture, tmp_path / "t.zarr", options=options)
    stored = load_transport(tmp_path / "t.zarr")
    whole, _ = reconstructed(memory=memory)
    for name in (*FACTORS, "provenance"):
        np.testing.assert_array_equal(getattr(stored, name), getattr(whole, name))
    for name in POSTERIOR_FIELDS:
        np.testing.assert_array_equal(
            getattr(stored.posterior, name), getattr(whole.posterior, name)
        )


def test_a_fault_in_a_later_block_leaves_nothing(tmp_path, by_chosen_plan):
    _, _, reconstructed = by_chosen_plan
    transport, _ = reconstructed()

    def faulty():
        yield of_rows(transport, slice(0, 5))
        raise InputError("a photo is damaged")

    with pytest.raises(InputError, match="a photo is damaged"):
        write_transport(tmp_path / "t.zarr", faulty(), 24)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("method", ["joint", "paper"])
def test_too_little_memory_is_said_before_any_work(captured, method):
    with pytest.raises(InputError, match=r"too little for one row.*`memory=\d00000000` or more"):
        reconstruction.reconstruct(captured(PLAN), method=method, memory=10**6)


def test_a_square_transport_in_tiles_is_that_of_the_whole(tmp_path):
    fine = model_transport(PROJECTOR, Size(48, 60), window=7, far=Size(3, 3), channels=3)
    plan = chosen_plan(PROJECTOR, 60, window=7)
    capture = acquire(plan, tmp_path / "c.zarr", _rig(fine.with_gains(near=0.1), SimulatedCamera()))
    known = given_correspondence(fine.correspondence, fine.camera, PROJECTOR)
    whole, _ = reconstruction.reconstruct(capture, known, square=True)
    # Measured in one piece, and estimated in tiles of 5 of the projector's rows.
    memory = memory_for(5, plan, PROJECTOR, "joint")
    options = ReconstructionOptions(square=True, memory=memory)
    summary = reconstruction.reconstruct_to_file(capture, tmp_path / "t.zarr", known, options)
    assert (summary.lit, summary.pixels) == (PROJECTOR.pixels, PROJECTOR.pixels)
    parts = load_transport(tmp_path / "t.zarr")
    for name in ("direct", "near", "far"):
        one, other = getattr(parts, name), getattr(whole, name)
        assert np.mean(np.abs(one - other) > 1e-3 * np.abs(other).max()) < 0.01, name


def test_the_square_transport_keeps_how_far_its_rows_are_to_be_trusted(captured_finer):
    fine, capture = captured_finer
    q = np.array(fine.correspondence, dtype=np.float32)
    q[:, :30] = np.nan
    known = given_correspondence(q, fine.camera, PROJECTOR)
    known.confidence[...] = np.where(known.lit, np.linspace(0, 1, 48)[:, None], 0.0)
    transport, _ = reconstruct(capture, known, square=True)
    lit = np.zeros(PROJECTOR, bool)
    nearest = np.rint(q[known.lit]).astype(int)
    lit[nearest[:, 0], nearest[:, 1]] = True
    assert not transport.quality.saturated.any()
    np.testing.assert_array_equal(transport.quality.confidence[~lit], 0)
    for y, x in ((3, 20), (20, 25)):
        mine = (np.rint(q) == (y, x)).all(axis=-1)
        assert transport.quality.confidence[y, x] == pytest.approx(known.confidence[mine].mean())


def test_the_square_transport_by_reference(tmp_path):
    fine = model_transport(PROJECTOR, Size(48, 60), window=7, far=Size(3, 3)).with_gains(near=0.1)
    capture = acquire(BY_REFERENCE, tmp_path / "c.zarr", _rig(fine))
    transport, _ = reconstruct(capture, square=True)
    assert transport.camera == PROJECTOR
    assert transport.provenance["square"]


def test_a_plan_of_phase_takes_a_correspondence_that_is_given(tmp_path, world):
    plan = paper_plan(PROJECTOR, 7, Size(3, 3), offset="reference", correspondence="phase")
    capture = acquire(plan, tmp_path / "c.zarr", _rig(world))
    given = given_correspondence(world.correspondence, world.camera, PROJECTOR)
    transport, _ = reconstruct(capture, given)
    light = nearfar.random_pattern(PROJECTOR, 1)
    assert snr(world @ light, transport @ light) > 60


def test_a_plan_by_reference_that_lacks_photos_is_refused(tmp_path, world):
    for number, (lacking, message) in enumerate(
        [
            (lambda p: p.purpose == "direct", "not the paper's"),
            (lambda p: p.purpose == "reference", "too few to estimate noise and drift"),
        ]
    ):
        patterns = tuple(p for p in BY_REFERENCE.patterns if not lacking(p))
        plan = BY_REFERENCE.model_copy(update={"patterns": patterns})
        capture = acquire(plan, tmp_path / f"{number}.zarr", _rig(world))
        with pytest.raises(InputError, match=message):
            reconstruct(capture)


def test_a_rig_of_another_size_is_refused(tmp_path, world):
    with pytest.raises(InputError, match=r"`projector=\(24, 30\)`"):
        acquire(paper_plan(Size(30, 24), 7, Size(3, 3)), tmp_path / "c.zarr", _rig(world))
    assert list(tmp_path.iterdir()) == []


def test_exposure_is_remembered_so_that_truth_compares(tmp_path, world):
    exact = _exact_of(world.with_gains(direct=1e-3, near=1e-3, far=1e-3))
    rig = replace(_rig(exact), exposure=1000.0)
    transport, _ = reconstruct(acquire(PLAN, tmp_path / "c.zarr", rig))
    found = relighting_snr(transport, exact, {"white": nearfar.white(PROJECTOR)})
    assert found["white"] > 60


def test_judgement_is_json_and_the_ceiling_is_above(tmp_path):
    truth = nearfar.open_rig("cornell", Size(16, 16)).world
    plan = paper_plan(Size(16, 16), 5, Size(3, 3))
    rig = open_rig("cornell", Size(16, 16))
    transport, _ = reconstruct(acquire(plan, tmp_path / "c.zarr", rig))
    judged = judge_by_truth(transport, truth)
    assert json.loads(json.dumps(judged, allow_nan=False)) == judged
    assert set(judged["snr"]) == {"T", "physical", "model", "floodlit"}
    assert judged["snr_b"]["white"] > 40
    # The best fit of rows is not the best of every picture, but of their mean it is.
    assert judged["ceiling"]["snr_b_pictures"] > judged["snr_b_pictures"]
    assert judged["snr_t"]["p5"] <= judged["snr_t"]["p50"] <= judged["snr_t"]["p95"]


def test_functions_of_several_pixels_have_no_ceiling_of_single_ones(tmp_path):
    plan = choose_plan(Size(32, 32), 60)[0].model_copy(update={"pitch": 2, "window": 7})
    rig = open_rig("cornell", Size(32, 32))
    transport, _ = nearfar.reconstruct(acquire(plan, tmp_path / "c.zarr", rig))
    judged = judge_by_truth(transport, rig.world)
    assert transport.pitch == 2
    assert judged["snr_b_pictures"] > 25
    assert "ceiling" not in judged
    assert set(judged["snr"]) == {"T", "physical", "floodlit"}


def test_a_truth_of_another_size_is_refused(world):
    other = _exact_of(model_transport(PROJECTOR, Size(4, 4), window=7, far=Size(3, 3), channels=3))
    with pytest.raises(InputError, match="compare two of the same scene"):
        judge_by_truth(world, other)


def test_a_capture_remembers_its_rig(captured):
    capture = open_capture(captured(PLAN).path)
    assert capture.rig["scene"] == "test"
    assert capture.rig["camera"]["bits"] == 16
    assert capture.plan == PLAN
    transport, _ = reconstruct(capture)
    assert transport.provenance["rig"] == capture.rig
    assert transport.provenance["plan"]["window"] == 7


@pytest.mark.parametrize("method", ["paper", "joint"])
def test_a_plan_of_gray_code_corresponds_by_it(captured, method):
    plan = paper_plan(PROJECTOR, 7, Size(3, 3), correspondence="gray")
    capture = captured(plan)
    transport, correspondence = reconstruct(capture, method=method)
    expected = correspond_by_gray_code(capture)
    np.testing.assert_array_equal(correspondence.q, expected.q)
    np.testing.assert_array_equal(transport.lit, expected.lit)
    # In blocks, too.
    memory = memory_for(5, plan, capture.camera, method)
    _, parts = reconstruct(capture, method=method, memory=memory)
    assert np.mean(parts.q == expected.q) > 0.95


def test_a_plan_without_stripes_corresponds_by_phase(captured, world):
    plan = paper_plan(PROJECTOR, 7, Size(3, 3), correspondence="none")
    capture = captured(plan)
    transport, correspondence = reconstruct(capture)
    assert np.abs(correspondence.q - world.correspondence).max() < 0.5
    light = nearfar.random_pattern(PROJECTOR, 1)
    assert snr(world @ light, transport @ light) > 30


@pytest.mark.slow
def test_few_photos_that_were_chosen_relight_as_well_as_many(tmp_path):
    scene = cached_scene("cornell", Size(32, 32))
    lights = {
        "picture": natural_picture(scene.projector, 1),
        "random": nearfar.random_pattern(scene.projector, 1),
    }

    def scores(plan, method):
        rig = SimulatedRig(scene, "cornell", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
        capture = acquire(plan, tmp_path / f"{method}.zarr", rig)
        transport, _ = reconstruction.reconstruct(capture, method=method)
        return relighting_snr(transport, scene, lights)

    many = scores(paper_plan(scene.projector, 7, Size(5, 5)), "paper")
    few = chosen_plan(scene.projector, 52, window=7)
    found = scores(few, "joint")
    # 144 photos of transport and 64 of stripes against 52.
    assert found["picture"] > many["picture"] - 0.3
    assert found["random"] > many["random"] - 3
