"""The model's check against transports that obey it, break it by a known amount, or are exact."""

import numpy as np
import pytest
from scipy import sparse

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.illumination.frequencies import band, near_frequencies
from nearfar.illumination.patterns import exponential
from nearfar.transport.exact import ExactTransport
from nearfar.transport.model import Transport
from nearfar.workflow.check import check_model, default_sample, dropped_of
from nearfar.workflow.conditioning import condition_near
from nearfar.workflow.model_fit import split_by_model
from nearfar.workflow.verdict.model_check import describe_verdict, judge_check
from tests.worlds import model_transport

PROJECTOR, CAMERA = Size(16, 20), Size(8, 9)


def _exact(near: np.ndarray, far: np.ndarray, direct: float = 0.5) -> ExactTransport:
    """Camera pixel c sees projector pixel 4 c directly; near and far are (C, P)."""
    rows = np.arange(CAMERA.pixels)
    d = np.zeros((CAMERA.pixels, PROJECTOR.pixels), dtype=np.float32)
    d[rows, 4 * rows] = direct
    parts = [sparse.csr_array(part.astype(np.float32)) for part in (d, near)]
    return ExactTransport(PROJECTOR, CAMERA, (parts[0],), (parts[1],), far[None].astype(np.float32))


def _nothing() -> np.ndarray:
    return np.zeros((CAMERA.pixels, PROJECTOR.pixels))


def test_a_transport_of_the_model_keeps_to_it():
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=2)
    check = check_model(world, 5, Size(3, 3))
    assert check.near_outside < 1e-10
    assert check.far_beyond < 1e-10
    assert check.checkerboard_near < 1e-4
    assert check.checkerboard_far < 1e-4
    assert check.camera_pixels == CAMERA.pixels
    assert check_model(world, 3, Size(3, 3)).near_outside > 0.1
    assert check_model(world, 5, Size(1, 1)).far_beyond > 1e-3


def test_known_frequencies_are_found_where_they_are():
    y = np.indices(PROJECTOR)[0]
    wave = (1 + np.cos(2 * np.pi * (3 * y / 16))).ravel()
    check = check_model(_exact(_nothing(), np.tile(wave, (CAMERA.pixels, 1))), 5, Size(3, 3))
    # |1|^2 at DC and 2 |1/2|^2 at +-3: a third lies beyond a band of -1 ... 1.
    assert check.far_beyond == pytest.approx(1 / 3, abs=1e-6)
    assert check.far_bandwidth[0.5] == 0.0
    assert check.far_bandwidth[0.99] == pytest.approx(3 / 16)
    wide = check_model(_exact(_nothing(), np.tile(wave, (CAMERA.pixels, 1))), 5, Size(7, 3))
    assert wide.far_beyond < 1e-6
    across = check_model(_exact(_nothing(), np.tile(wave, (CAMERA.pixels, 1))), 5, Size(3, 7))
    assert across.far_beyond == pytest.approx(1 / 3, abs=1e-6)


def test_the_checkerboard_is_measured_against_direct_light():
    y, x = np.indices(PROJECTOR)
    board = 1.0 - 2.0 * ((y + x) % 2)
    far = np.tile((1 + board).ravel() / PROJECTOR.pixels, (CAMERA.pixels, 1))
    near = _nothing()
    near[np.arange(CAMERA.pixels), 4 * np.arange(CAMERA.pixels)] = 0.05
    check = check_model(_exact(near, 0.25 * far), 5, Size(3, 3))
    assert check.checkerboard_far == pytest.approx(0.25 / 0.5, rel=1e-5)
    assert check.checkerboard_near == pytest.approx(0.05 / 0.5, rel=1e-5)
    assert np.nanmax(np.abs(check.checkerboard_map)) <= 0.6 + 1e-6
    assert check.floodlit == pytest.approx({"direct": 0.625, "near": 0.0625, "far": 0.3125})


def test_what_the_window_takes_up_of_f_is_told():
    far = _nothing()
    rows = np.arange(CAMERA.pixels)
    far[rows, 4 * rows] = 1.0
    inside = check_model(_exact(_nothing(), far), 5, Size(3, 3))
    # A peak at q less its low frequencies: nearly all at q itself.
    assert inside.far_beyond_in_window > 0.97
    far = np.roll(far, 8, axis=1)
    assert check_model(_exact(_nothing(), far), 5, Size(3, 3)).far_beyond_in_window < 0.03


def test_a_sample_says_about_the_same_as_all():
    world = model_transport(PROJECTOR, Size(24, 30), window=5, far=Size(3, 3), seed=3)
    whole, part = (check_model(world, 3, Size(1, 3), sample=n) for n in (10**6, 100))
    assert whole.camera_pixels == 720
    assert 80 <= part.camera_pixels <= 110
    assert part.near_outside == pytest.approx(whole.near_outside, rel=0.1)


@pytest.mark.parametrize(("window", "dropped"), [(5, Size(1, 1)), (6, Size(3, 3)), (7, Size(3, 1))])
def test_conditioning_is_that_of_the_patterns_themselves(window, dropped):
    projector = Size(13, 11)
    found = condition_near(projector, window, dropped)
    assert found.whole == pytest.approx(1.0)
    frequencies = near_frequencies(window, dropped)
    # An even window's checkerboard is the direct measurement and is not among them.
    assert found.unseen == window**2 - len(frequencies)
    shown = np.array([exponential(k, projector) for k in frequencies])
    conditions = []
    for y in range(-(window // 2), projector.height - window // 2):
        for x in range(-(window // 2), projector.width - window // 2):
            cut = shown[:, max(y, 0) : y + window, max(x, 0) : x + window]
            values = np.linalg.svd(cut.reshape(len(shown), -1), compute_uv=False)
            seen = values[values > 1e-3 * values[0]]
            conditions.append(seen[0] / seen[-1])
    assert found.worst == pytest.approx(max(conditions), rel=1e-6)


def test_what_cannot_be_checked_is_refused():
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3))
    with pytest.raises(InputError, match="do not fit"):
        check_model(world, 17, Size(3, 3))
    with pytest.raises(InputError, match="do not fit"):
        check_model(world, 5, Size(3, 21))
    for wrong in ({"sample": 0}, {"k_near": -1.0}):
        with pytest.raises(InputError, match="above 0"):
            check_model(world, 5, Size(3, 3), **wrong)
    dark = ExactTransport(PROJECTOR, CAMERA, (), (), _nothing()[None].astype(np.float32))
    with pytest.raises(InputError, match="holds no light at all"):
        check_model(dark, 5, Size(3, 3))


def _together(world: Transport) -> ExactTransport:
    """All of T in one matrix, as a measured one comes."""
    dense = np.ascontiguousarray(np.moveaxis(world.dense(), 1, 0))
    return ExactTransport(world.projector, world.camera, (), (), dense)


def test_a_dense_transport_is_split_as_the_model_does():
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=2)
    check = check_model(_together(world), 5, Size(3, 3))
    assert check.is_split_by_model
    assert not check_model(world, 5, Size(3, 3)).is_split_by_model
    # Its q is found, and D + N + F of the model holds all of it.
    split = split_by_model(_together(world), 5, Size(3, 3))
    off = np.linalg.norm(split.correspondence - world.correspondence, axis=-1)
    assert np.median(off) < 0.2
    assert off.max() < 1
    assert check.best_pictures > 60
    assert check.best_rows > 60
    assert check.lit == 1.0
    assert check.far_beyond < 1e-5
    assert judge_check(check).grade == "good"
    for rows, part in zip(split.component_rows(slice(4, 9)), "DNF", strict=True):
        assert rows.shape == (5, 2, PROJECTOR.pixels), part
    direct, rest = split.floodlit()
    light = np.ones(PROJECTOR, dtype=np.float32)
    np.testing.assert_allclose(direct + rest, world @ light, rtol=1e-5)


def _lamps() -> ExactTransport:
    """Every camera pixel sees a wide, smooth mix of all projector pixels."""
    y, x = np.indices(PROJECTOR).reshape(2, -1)
    rows = np.linspace(0, 15, CAMERA.height).repeat(CAMERA.width)
    columns = np.tile(np.linspace(0, 19, CAMERA.width), CAMERA.height)
    away = (rows[:, None] - y) ** 2 + (columns[:, None] - x) ** 2
    return ExactTransport(PROJECTOR, CAMERA, (), (), np.exp(-away / 60)[None].astype(np.float32))


def test_the_verdict_follows_what_the_model_can_hold():
    lamps = check_model(_lamps(), 5, Size(3, 3))
    assert lamps.lit == 0.0
    verdict = judge_check(lamps)
    assert verdict.grade == "wrong"
    assert "100% of the camera pixels see no direct light" in verdict.causes[0]
    # As many frequencies as it has hold it all the same.
    assert judge_check(check_model(_lamps(), 5, Size(15, 19))).grade == "good"
    y = np.indices(PROJECTOR)[0]
    wave = 0.01 * (1 + np.cos(2 * np.pi * (3 * y / 16))).ravel()
    outside = check_model(_exact(_nothing(), np.tile(wave, (CAMERA.pixels, 1))), 5, Size(3, 3))
    assert "of the energy of F lies beyond the far band" in judge_check(outside).causes[0]
    assert describe_verdict(judge_check(outside)).startswith(f"{judge_check(outside).grade}: The")


def test_a_projector_of_one_row_is_checked():
    generator = np.random.default_rng(1)
    matrix = generator.uniform(size=(6, 24)).astype(np.float32)
    matrix[np.arange(6), 4 * np.arange(6)] = 20.0
    for projector, far in ((Size(1, 24), Size(1, 5)), (Size(24, 1), Size(5, 1))):
        row = ExactTransport(projector, Size(2, 3), (), (), matrix[None], "a row")
        check = check_model(row, 5, far)
        assert check.lit == 1.0
        assert 15 < check.best_rows < 60
        assert dropped_of(projector, 5, far, None) == Size(1, 1)


def test_camera_pixels_without_light_count_neither_way():
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3))
    dark = _together(world)
    dark.far[:, :20] = 0.0
    check = check_model(dark, 5, Size(3, 3))
    assert check.lit == 1.0
    assert check.best_rows > 60


@pytest.mark.parametrize(
    ("projector", "pixels"),
    [((16, 16), 4096), ((128, 128), 4096), ((256, 256), 2048), ((4320, 7680), 64)],
)
def test_fewer_camera_pixels_are_looked_at_where_rows_are_long(projector, pixels):
    assert default_sample(Size(*projector)) == pixels


@pytest.mark.parametrize("far", [Size(3, 5), Size(4, 5), Size(4, 6), Size(1, 20)])
def test_energy_beyond_the_band_is_that_of_all_frequencies(far):
    rows = np.random.default_rng(4).normal(size=(CAMERA.pixels, PROJECTOR.pixels))
    check = check_model(_exact(_nothing(), rows), 5, far)
    spectrum = np.fft.fft2(rows.reshape(-1, *PROJECTOR))
    held = [
        np.isin(np.rint(np.fft.fftfreq(n) * n), band(m))
        for n, m in zip(PROJECTOR, far, strict=True)
    ]
    in_band = np.outer(*held)
    energy = np.abs(spectrum) ** 2
    share = energy[:, ~in_band].sum() / energy.sum()
    assert check.far_beyond == pytest.approx(share, rel=1e-5)
    # As pictures, frequencies of even bands that lack their opposites are half there.
    high = np.fft.ifft2(np.where(in_band, 0, spectrum)).real
    pixel = 40
    y, x = divmod(4 * pixel, PROJECTOR.width)
    apart = np.maximum(*np.abs(np.indices(PROJECTOR) - np.array([y, x])[:, None, None]))
    outside = (high[pixel] ** 2)[apart > 2].sum() / (rows[pixel] ** 2).sum()
    assert check.far_beyond_map[pixel] == pytest.approx(outside, rel=1e-4)
