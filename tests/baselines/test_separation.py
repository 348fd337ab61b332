"""Direct-global separation: patterns, formulas, camera pixels between pixels, noise."""

import numpy as np
import pytest
from scipy import sparse

from nearfar import ExactTransport, Size, snr
from nearfar.baselines.separation import (
    Separation,
    black_over_white_less_black,
    separate_by_extremes,
    separate_by_pairs,
    separate_by_phase,
)
from nearfar.baselines.separation_methods import (
    Method,
    by_any_patterns,
    by_checkerboards,
    by_sinusoids,
)
from nearfar.baselines.separation_patterns import (
    checkerboards,
    count_checkerboards,
    count_sinusoids,
    sinusoids,
)
from nearfar.baselines.separation_photos import (
    PhotosToSeparate,
    separate,
    shoot_to_separate,
    spread_of_groups,
)
from nearfar.errors import InputError
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.separate import compare_to_truth
from tests.conftest import QUIET

PROJECTOR = Size(12, 16)
CAMERA = Size(7, 5)


def world(weights: tuple[float, ...] = (1.0,), *, seed: int = 0) -> ExactTransport:
    """Draw direct light spread over pixels side by side, and global light from all pixels alike."""
    generator = np.random.default_rng(seed)
    pixels = CAMERA.pixels
    y = generator.integers(0, PROJECTOR.height, size=pixels)
    x = generator.integers(0, PROJECTOR.width - 1, size=pixels)
    direct = []
    for channel in range(3):
        matrix = np.zeros((pixels, *PROJECTOR))
        strength = generator.uniform(0.1, 0.5, size=pixels)
        # A channel without direct light, and pixels without any.
        strength[3 + channel] = 0
        strength[:2] = 0
        for offset, weight in enumerate(weights):
            matrix[np.arange(pixels), y, x + offset] = weight * strength
        direct.append(sparse.csr_array(matrix.reshape(pixels, -1).astype(np.float32)))
    level = generator.uniform(0.05, 0.3, size=(3, pixels, 1)).astype(np.float32)
    far = np.broadcast_to(level / PROJECTOR.pixels, (3, pixels, PROJECTOR.pixels))
    empty = tuple(0 * part for part in direct)
    return ExactTransport(PROJECTOR, CAMERA, tuple(direct), empty, np.array(far), "drawn")


def truth_of(scene: ExactTransport) -> Separation:
    direct, near, far = scene.component_pictures(np.ones(scene.projector, dtype=np.float32))
    return Separation(direct, near + far)


def photos_of(scene: ExactTransport, patterns: np.ndarray, black_level: float = 0.0) -> np.ndarray:
    """Photograph without ambient light; black_level as a share of white."""
    optics = SimulatedProjector(black_level=black_level)
    return scene.pictures(np.stack([optics.emit(pattern) for pattern in patterns]))


def assert_close(found: Separation, known: Separation, tolerance: float) -> None:
    for mine, values in zip(found, known, strict=True):
        assert mine.dtype == np.float32
        np.testing.assert_allclose(mine, values, atol=tolerance)


# Patterns


@pytest.mark.parametrize(
    ("side", "step", "count"),
    [(1, 1, 2), (2, 1, 8), (2, 2, 2), (3, 1, 18), (3, 2, 8), (4, 1, 32), (4, 3, 8), (6, 4, 8)],
)
@pytest.mark.parametrize("projector", [Size(12, 16), Size(13, 17)])
def test_checkerboards_light_every_pixel_half_the_time(projector, side, step, count):
    shown = checkerboards(projector, side, step)
    assert shown.shape == (count, *projector)
    assert shown.dtype == np.uint8
    assert count == count_checkerboards(side, step)
    assert set(np.unique(shown)) == {0, 255}
    np.testing.assert_array_equal(shown[::2] + shown[1::2], 255)
    assert (shown.mean(axis=0) == 127.5).all()
    assert len({pattern.tobytes() for pattern in shown}) == count


def test_checkerboards_are_squares_that_shift():
    shown = checkerboards(PROJECTOR, 3, 1).reshape(3, 3, 2, *PROJECTOR)
    square = np.array([[255, 0], [0, 255]], dtype=np.uint8)
    tiles = np.tile(square, (2, 3))
    np.testing.assert_array_equal(shown[0, 0, 0, :12, :16], np.kron(tiles, np.ones((3, 3)))[:, :16])
    # A shift moves the pattern towards the origin.
    np.testing.assert_array_equal(shown[2, 1, 0][:-2, :-1], shown[0, 0, 0][2:, 1:])
    np.testing.assert_array_equal(shown[0, 2, 1][:, :-2], shown[0, 0, 1][:, 2:])


def test_step_is_half_a_square_if_left_out():
    for side, step in ((1, 1), (2, 1), (3, 2), (4, 2), (5, 3)):
        np.testing.assert_array_equal(
            checkerboards(PROJECTOR, side), checkerboards(PROJECTOR, side, step)
        )


@pytest.mark.parametrize("period", [2, 3, 5, 8, 12])
@pytest.mark.parametrize("shifts", [3, 4, 5, 6])
def test_sinusoids_have_these_values(period, shifts):
    shown = sinusoids(PROJECTOR, period, shifts)
    assert shown.shape == (count_sinusoids(shifts), *PROJECTOR)
    assert shown.dtype == np.uint8
    along_y, along_x = shown.reshape(2, shifts, *PROJECTOR).astype(float)
    for j in range(shifts):
        for shifted, place in ((along_y[j], np.arange(12)), (along_x[j].T, np.arange(16))):
            wave = 127.5 * (1 + np.cos(2 * np.pi * (place / period + j / shifts)))
            assert (np.abs(shifted - wave[:, None]) <= 0.5 + 1e-6).all()
    if shifts % 2 == 0:
        half = shifts // 2
        assert (along_y[:half] + along_y[half:] == 255).all()
        assert (shown.mean(axis=0) == 127.5).all()
    else:
        assert np.abs(shown.mean(axis=0) - 127.5).max() <= 0.5


@pytest.mark.parametrize(
    ("draw", "words"),
    [
        (lambda: checkerboards(PROJECTOR, 0), "`side=0`"),
        (lambda: checkerboards(PROJECTOR, 7), "1 to 6"),
        (lambda: checkerboards(PROJECTOR, 2, 3), "`step=3`"),
        (lambda: checkerboards(PROJECTOR, 2, 0), "`step=0`"),
        (lambda: count_checkerboards(0), "squares of 0"),
        (lambda: checkerboards(Size(1, 40), 21), "1 to 20"),
        (lambda: sinusoids(Size(1, 1), 3), "1x1"),
        (lambda: sinusoids(PROJECTOR, 1), "`period=1`"),
        (lambda: sinusoids(PROJECTOR, 13), "2 to 12"),
        (lambda: sinusoids(PROJECTOR, 3, 2), "`shifts=2`"),
    ],
)
def test_patterns_that_cannot_be(draw, words):
    with pytest.raises(InputError, match=words):
        draw()


# Formulas


def test_the_papers_formula_with_a_black_level():
    # Its L_d and L_g count what the projector cannot hold back: full white is 1.
    b, direct, global_ = 0.2, 0.4, 0.3
    lit = direct + (1 + b) * global_ / 2
    unlit = b * direct + (1 + b) * global_ / 2
    photos = np.array([lit, unlit]).reshape(2, 1, 1, 1)
    for found in (separate_by_extremes(photos, b), separate_by_pairs(photos, b)):
        # White less black is (1 - b) of white.
        assert found.direct.item() == pytest.approx((1 - b) * direct, rel=1e-6)
        assert found.global_.item() == pytest.approx((1 - b) * global_, rel=1e-6)


METHODS = [by_checkerboards(side) for side in (1, 2, 4)] + [by_sinusoids(4, shifts=8)]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: str(method.settings))
@pytest.mark.parametrize("black_level", [0.0, 0.05, 0.5])
def test_light_that_obeys_the_model_is_separated(method: Method, black_level: float):
    scene = world()
    patterns = method.draw(PROJECTOR)
    photos = photos_of(scene, patterns, black_level)
    # 8 bits round a sinusoid; a checkerboard has none between.
    # Photos are float32, and what a black level takes of their contrast is made up for.
    exact = 2e-6 / (1 - black_level)
    tolerance = exact if method.settings["pattern"] == "checkerboard" else 2e-3
    assert_close(method.separate(photos, black_level), truth_of(scene), tolerance)
    under_black = photos_of(scene, np.zeros_like(patterns[:1]), black_level)
    assert_close(method.separate(photos - under_black, 0.0), truth_of(scene), tolerance)
    assert_close(separate_by_extremes(photos, black_level), truth_of(scene), 0.01)
    if black_level:
        wrong = method.separate(photos, 0.0)
        assert snr(truth_of(scene).global_, wrong.global_) < 30


def test_sinusoids_are_fitted_exactly():
    scene, period, shifts = world(), 4, 5
    place = np.indices(PROJECTOR)[:, None] / period + np.arange(shifts)[:, None, None] / shifts
    lights = 0.5 + 0.5 * np.cos(2 * np.pi * place).reshape(-1, *PROJECTOR)
    photos = scene.pictures(lights).astype(np.float64)
    known = truth_of(scene)
    assert_close(separate_by_phase(photos, shifts), known, 1e-6)
    # Five phases miss the crest and the trough of most pixels.
    assert np.abs(separate_by_extremes(photos).direct - known.direct).max() > 0.01


@pytest.mark.parametrize("method", [*METHODS, by_any_patterns()], ids=lambda m: str(m.settings))
def test_separation_scales_with_the_light(method: Method):
    photos = np.random.default_rng(3).uniform(0.1, 0.8, size=(16, 4, 5, 3))
    one, two = method.separate(photos, 0.1), method.separate(0.5 * photos, 0.1)
    for mine, other in zip(one, two, strict=True):
        np.testing.assert_allclose(0.5 * mine, other, rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("method", METHODS, ids=lambda method: str(method.settings))
def test_direct_and_global_sum_to_white_less_black(method: Method):
    # Whatever the transport: here every row is random.
    generator = np.random.default_rng(5)
    far = generator.uniform(0, 1e-2, size=(3, CAMERA.pixels, PROJECTOR.pixels)).astype(np.float32)
    scene = ExactTransport(PROJECTOR, CAMERA, (), (), far)
    found = method.separate(photos_of(scene, method.draw(PROJECTOR), 0.1), 0.1)
    floodlit = scene @ np.ones(PROJECTOR, dtype=np.float32)
    np.testing.assert_allclose(found.direct + found.global_, floodlit, rtol=1e-5)


def test_camera_pixels_between_projector_pixels_need_larger_squares():
    scene = world((0.5, 0.5))
    known = truth_of(scene)
    for side, least, most in ((1, 0, 3), (2, 100, 300), (4, 100, 300)):
        photos = photos_of(scene, checkerboards(PROJECTOR, side)).astype(np.float64)
        assert least <= snr(known.direct, separate_by_pairs(photos).direct) <= most


def test_noise_makes_extremes_too_far_apart_and_pairs_less_so():
    scene = world()
    known = truth_of(scene)
    photos = photos_of(scene, checkerboards(PROJECTOR, 4, 1))
    noise = np.random.default_rng(0).normal(0, 0.01, size=(20, *photos.shape))
    error = {}
    lit = known.direct.min(axis=-1) > 0.05
    for method in (separate_by_extremes, separate_by_pairs):
        found = [method(photos + one) for one in noise]
        direct = np.stack([one.direct for one in found]) - known.direct
        error[method] = (direct[:, lit].mean(), direct[:, lit].std())
    bias, spread = error[separate_by_extremes]
    assert bias > 0.01
    assert abs(error[separate_by_pairs][0]) < 0.1 * bias
    assert error[separate_by_pairs][1] < 0.5 * spread


def test_the_phase_of_all_channels_keeps_a_dark_one_from_brightening():
    generator = np.random.default_rng(1)
    angles = 2 * np.pi * np.arange(4) / 4
    wave = 0.2 + np.array([0.1, 0.1, 0.0]) * np.cos(angles)[:, None]
    photos = np.tile(wave[:, None, None, :], (2, 50, 50, 1))
    found = separate_by_phase(photos + generator.normal(0, 0.01, size=photos.shape), 4)
    np.testing.assert_allclose(found.direct.mean(axis=(0, 1)), [0.2, 0.2, 0.0], atol=1e-3)


@pytest.mark.parametrize(
    ("separate_them", "words"),
    [
        (lambda: separate_by_pairs(np.zeros((3, 2, 2, 1))), "3 photos"),
        (lambda: separate_by_pairs(np.zeros((0, 2, 2, 1))), "0 photos"),
        (lambda: separate_by_extremes(np.zeros((1, 2, 2, 1))), "1 photos"),
        (lambda: separate_by_phase(np.zeros((7, 2, 2, 1)), 4), "multiple of 4"),
        (lambda: separate_by_phase(np.zeros((4, 2, 2, 1)), 2), "3 or more"),
        (lambda: separate_by_pairs(np.zeros((2, 2, 2))), "height x width"),
        (lambda: separate_by_pairs(np.zeros((2, 2, 2, 1), dtype=np.uint8)), "uint8"),
        *(
            (lambda b=b: separate_by_extremes(np.zeros((2, 2, 2, 1)), b), "black level")
            for b in (-0.1, 1.0, np.nan, np.inf)
        ),
    ],
)
def test_photos_that_cannot_be_separated(separate_them, words):
    with pytest.raises(InputError, match=words):
        separate_them()


def test_black_in_units_of_white_less_black():
    for b in (0.0, 0.05, 0.9):
        optics = SimulatedProjector(black_level=b)
        black, white = (optics.emit(np.array(v, dtype=np.uint8)) for v in (0, 255))
        assert black_over_white_less_black(b) == pytest.approx(float(black), rel=1e-6)
        assert float(white - black) == pytest.approx(1.0)
        assert float(black / white) == pytest.approx(b)


def test_dark_stays_dark():
    photos = np.zeros((8, 3, 4, 2))
    for found in (separate_by_pairs(photos), separate_by_phase(photos, 4)):
        assert not found.direct.any()
        assert not found.global_.any()


# Photos of a rig


def rig_of(scene: ExactTransport, camera: SimulatedCamera, black_level: float = 0.0):
    optics = SimulatedProjector(black_level=black_level)
    return SimulatedRig(scene, scene.name, optics, camera, 1.0, 0)


@pytest.mark.parametrize("black_level", [0.0, 0.1])
def test_a_rig_needs_no_black_level(black_level: float):
    scene, method = world(), by_checkerboards()
    rig = rig_of(scene, QUIET, black_level)
    taken = shoot_to_separate(rig, method.draw(PROJECTOR))
    assert (taken.dark_shows, taken.black_level) == ("black", 0.0)
    assert (taken.camera, taken.channels) == (CAMERA, 3)
    assert_close(separate(taken, method.separate), truth_of(scene), 1e-4)


def test_rows_at_a_time_give_the_same(monkeypatch: pytest.MonkeyPatch):
    scene, method = world(), by_checkerboards()
    taken = shoot_to_separate(rig_of(scene, SimulatedCamera()), method.draw(PROJECTOR))
    whole = separate(taken, method.separate)
    steadiness = spread_of_groups(taken, method.groups)
    shares: list[float] = []
    monkeypatch.setattr("nearfar.baselines.separation_photos.VALUES_AT_ONCE", 8 * 5 * 3 * 2)
    cut = separate(taken, method.separate, progress=shares.append)
    assert len(shares) == 4
    assert shares[-1] == 1.0
    assert spread_of_groups(taken, method.groups) == pytest.approx(steadiness)
    for mine, other in zip(cut, whole, strict=True):
        np.testing.assert_array_equal(mine, other)


def test_photos_out_of_order_are_unsteady():
    scene, method = world(), by_checkerboards()
    taken = shoot_to_separate(rig_of(scene, SimulatedCamera()), method.draw(PROJECTOR))
    shuffled = PhotosToSeparate(taken.photos[1:] + taken.photos[:1], taken.full_scale, taken.dark)
    assert spread_of_groups(taken, method.groups) < 0.02
    assert spread_of_groups(shuffled, method.groups) > 0.1


@pytest.mark.slow
def test_the_corner_is_separated_by_default():
    # The finer the projector, the better; 128x128 is in benchmarks/separation.py.
    known = cached_scene("corner", Size(48, 48))
    method = by_checkerboards()
    taken = shoot_to_separate(rig_of(known, QUIET), method.draw(known.projector))
    found = compare_to_truth(separate(taken, method.separate), known).snr
    assert found["direct"] > 40
    assert found["global"] > 30
    plain = compare_to_truth(separate(taken, separate_by_extremes), known).snr
    assert plain["direct"] < found["direct"] - 5
    assert plain["global"] < found["global"] - 5
