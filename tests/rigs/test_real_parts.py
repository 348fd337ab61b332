"""The parts of a real rig, each by itself: in step, retried, adding up, stale, changed."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import DeviceError, LostPhotoError
from nearfar.rigs.base import MAXIMUM_TRIES
from nearfar.rigs.real.alarms import AlarmLog
from nearfar.rigs.real.black_and_white import agree_in_mean, measure_black_and_white
from nearfar.rigs.real.light import ExpectedLight
from nearfar.rigs.real.shutter import Shutter
from nearfar.rigs.real.stale import MINIMUM_FALSE_SUSPICIONS, StalePhotos
from nearfar.rigs.real.superposition import check_superposition, halves
from nearfar.rigs.real.synchronising import MAXIMUM_SETTLE_REFRESHES, synchronise
from tests.rigs.table import TableCamera, TableScreen

GRID = Size(16, 20)
BLACK, WHITE = (np.full(GRID, v, np.uint8) for v in (0, 255))


class Copier:
    """Photographs a pattern as it is: each value by a gain, with noise, black above 0."""

    def __init__(self, gamma=1.0):
        self.gamma = gamma
        self.generator = np.random.default_rng(0)

    def __call__(self, pattern, lamp=1.0, ambient=0.0):
        light = lamp * (pattern / 255) ** self.gamma + ambient
        levels = 1000 + 40000 * light + self.generator.normal(0, 30, GRID)
        return np.rint(levels).astype(np.uint16)[..., np.newaxis]


@pytest.fixture
def copier():
    return Copier()


@pytest.fixture
def levels(copier):
    return measure_black_and_white(*([copier(p) for _ in range(2)] for p in (BLACK, WHITE)))


def _patterns(count=8):
    y, x = np.mgrid[: GRID.height, : GRID.width]
    return [
        np.rint(127.5 + 127.5 * np.cos(0.7 * (k + 1) * y + 0.9 * (k + 1) * x)).astype(np.uint8)
        for k in range(count)
    ]


@pytest.mark.parametrize("late", [0, 1, 3, 20])
def test_synchronising_waits_until_photos_follow(copier, late):
    displayed = [BLACK]

    def photograph(frame, settle):
        displayed.append(frame)
        return copier(displayed[-1 if settle >= late else -2])

    found = synchronise(photograph, BLACK, WHITE, 1)
    assert found.settle >= late
    assert found.settle <= max(1, 2 * late)
    assert found.levels.contrast == pytest.approx(40000, rel=0.01)


def test_what_never_follows_ends_synchronising(copier):
    taken = []

    def photograph(frame, settle):
        taken.append(settle)
        # White is dimmer soon after black than later, however long is waited.
        return copier(frame, lamp=0.5 if settle < max(taken) or len(taken) % 5 == 2 else 1.0)

    with pytest.raises(DeviceError, match=f"even {MAXIMUM_SETTLE_REFRESHES} refreshes"):
        synchronise(photograph, BLACK, WHITE, 1)
    assert max(taken) == MAXIMUM_SETTLE_REFRESHES


@pytest.mark.parametrize(("lost", "alarms"), [(1, 1), (MAXIMUM_TRIES - 1, MAXIMUM_TRIES - 1)])
def test_the_shutter_takes_lost_photos_again(lost, alarms):
    screen = TableScreen()
    camera = TableCamera(screen, np.full((4, GRID.pixels), 1e-3), Size(2, 2), GRID)
    camera.wrong = dict.fromkeys(range(lost), "lost")
    log = AlarmLog()
    photo = Shutter(screen, camera, 2, log).photograph(np.zeros((72, 96), np.uint8), number=3)
    assert photo.shape == (2, 2, 1)
    assert camera.taken == lost + 1
    assert log.sentences == ["photo 3 was taken again: the photo was lost."] * alarms


def test_the_shutter_gives_up_after_the_maximum_of_tries():
    screen = TableScreen()
    camera = TableCamera(screen, np.full((4, GRID.pixels), 1e-3), Size(2, 2), GRID)
    camera.from_now_on = "lost"
    with pytest.raises(DeviceError, match=f"tried {MAXIMUM_TRIES} times") as raised:
        Shutter(screen, camera, 2, AlarmLog()).photograph(np.zeros((72, 96), np.uint8))
    assert not isinstance(raised.value, LostPhotoError)
    assert camera.taken == MAXIMUM_TRIES


def test_the_shutter_waits_as_long_as_it_is_told():
    screen = TableScreen()
    camera = TableCamera(screen, np.full((4, GRID.pixels), 1e-3), Size(2, 2), GRID)
    shutter, frame = Shutter(screen, camera, 3, AlarmLog()), np.zeros((72, 96), np.uint8)
    waited = []
    for settle in (None, 7):
        before = screen.clock
        shutter.photograph(frame, settle)
        waited.append((screen.clock - before - camera.device_exposure) / screen.period)
    np.testing.assert_allclose(waited, [3, 7])
    assert shutter.flush == 12
    shutter.settle = 20
    assert shutter.flush == 20


def test_light_that_adds_up_is_no_fault_and_halves_are_returned(copier, levels):
    found = check_superposition(copier, GRID, levels, is_calibrated=False)
    assert found.faults == ()
    for photo, half in zip((found.left, found.right), halves(GRID), strict=True):
        assert levels.is_same_light(photo, copier(half))


def test_a_gamma_is_seen_by_greys_alone(levels):
    found = check_superposition(Copier(gamma=2.2), GRID, levels, is_calibrated=True)
    (fault,) = found.faults
    assert fault.patterns == "127 and 128 of 255"
    assert fault.share == pytest.approx(2 * 0.5**2.2, abs=0.01)
    assert "calibrate again" in str(fault)


def test_a_projector_that_dims_bright_pictures_is_seen_by_halves(copier, levels):
    def photograph(pattern):
        return copier(pattern, lamp=1.1 if pattern.mean() < 140 else 1.0)

    found = check_superposition(photograph, GRID, levels, is_calibrated=False)
    assert [fault.patterns for fault in found.faults][-1] == "the left half and the right"
    assert found.faults[-1].share == pytest.approx(1.1, abs=0.01)


def test_stale_photos_are_told_from_fresh_ones(copier, levels):
    stale, patterns = StalePhotos(levels), _patterns()
    stale.begin_after(WHITE, copier(WHITE))
    before = WHITE
    for pattern in patterns:
        assert "once more" in stale.suspect(pattern, copier(before))
        torn = np.concatenate([copier(before)[:8], copier(pattern)[8:]])
        assert "part of it" in stale.suspect(pattern, torn)
        fresh = copier(pattern)
        assert stale.suspect(pattern, fresh) is None
        # A pattern that comes twice is rightly as before.
        stale.accept(pattern, fresh)
        assert stale.suspect(pattern, copier(pattern)) is None
        before = pattern


def test_a_camera_is_too_coarse_after_enough_false_suspicions(copier, levels):
    stale = StalePhotos(levels)
    stale.begin_after(WHITE, copier(WHITE))
    for _ in range(MINIMUM_FALSE_SUSPICIONS):
        assert not stale.is_too_coarse
        assert stale.suspect(BLACK, copier(WHITE)) is not None
        stale.accept_suspect()
    assert stale.is_too_coarse
    assert stale.suspect(BLACK, copier(WHITE)) is None


def test_light_that_deviates_is_seen_since_the_last_good_photo(copier, levels):
    light, (one, two, *_) = ExpectedLight(levels, 10), _patterns()
    assert light.compare(10, one, copier(one)) is None
    assert light.compare(11, 255 - one, copier(255 - one)) is None
    assert light.compare(12, two, copier(two)) is None
    found = light.compare(13, one, copier(one, ambient=0.05))
    assert found.last_good == 11
    assert found.share == pytest.approx(0.05, abs=0.005)
    assert not found.is_by_inverse
    found = light.compare(14, 255 - two, copier(255 - two, lamp=1.2))
    assert found.is_by_inverse
    light.ignore_inverses()
    light.start_again(levels)
    assert light.compare(15, two, copier(two, lamp=1.2)) is None
    assert light.compare(16, 255 - two, copier(255 - two, lamp=1.2)) is None
    assert light.compare(17, BLACK, copier(BLACK, ambient=0.05)).share == pytest.approx(
        0.05, abs=5e-3
    )
    assert ExpectedLight(levels).compare(0, WHITE, copier(WHITE, lamp=0.9)).last_good is None


@pytest.mark.parametrize(
    ("lamp", "ambient", "light"), [(1, 0, None), (0.9, 0, "lamp"), (1, 0.05, "ambient")]
)
def test_a_change_of_light_is_named(copier, levels, lamp, ambient, light):
    photos = [[copier(p, lamp, ambient) for _ in range(2)] for p in (BLACK, WHITE)]
    change = levels.change_to(measure_black_and_white(*photos))
    assert (change and change.light) == light
    assert agree_in_mean(*photos)
    assert not agree_in_mean([copier(BLACK), copier(BLACK, ambient=0.1)], photos[1])


def test_white_that_is_no_brighter_than_black_is_refused(copier):
    with pytest.raises(DeviceError, match="white looks like black"):
        measure_black_and_white(*([copier(BLACK) for _ in range(2)] for _ in range(2)))
