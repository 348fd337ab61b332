"""A real rig's doings, before a table that can do wrong: in step, noticed, mended or named."""

import re

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.errors import DeviceError, InputError
from nearfar.photometry.exposures import Sensor
from nearfar.plan import paper_plan
from nearfar.plan.choose import choose_plan
from nearfar.rigs.real.rig import RealRig
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.workflow.acquire import acquire
from tests.cli.conftest import run_nearfar
from tests.rigs.table import TableCamera, TableScreen

PROJECTOR, CAMERA = Size(12, 16), Size(24, 32)
BRACKET = (1.0, 4.0, 16.0)


@pytest.fixture(scope="module")
def transport():
    """Each camera pixel sees a projector pixel, and a little of all."""
    generator = np.random.default_rng(3)
    direct = np.zeros((*CAMERA, *PROJECTOR))
    y, x = np.mgrid[: CAMERA.height, : CAMERA.width]
    direct[y, x, y // 2, x // 2] = generator.uniform(0.3, 0.5, CAMERA)
    return direct.reshape(CAMERA.pixels, -1) + 0.1 / PROJECTOR.pixels


@pytest.fixture(scope="module")
def plan():
    return choose_plan(PROJECTOR, 60)[0]


@pytest.fixture
def table(transport):
    def lay(rig_options=(), **options):
        screen = TableScreen()
        camera = TableCamera(screen, transport, CAMERA, PROJECTOR, **options)
        told = []
        rig = RealRig(
            screen,
            camera,
            PROJECTOR,
            on_alarm=told.append,
            **{"exposure": 0.1, **dict(rig_options)},
        )
        return rig, camera, told

    return lay


def _photos(rig, plan):
    patterns = [plan.draw(i) for i in range(len(plan.patterns))]
    return np.stack([photo.astype(np.float64) for photo in rig.shoot(patterns)])


@pytest.fixture(scope="module")
def expected(transport, plan):
    """Photos without noise, in levels."""
    lights = np.stack([plan.draw(i).reshape(-1) / 255 for i in range(len(plan.patterns))])
    pictures = (lights @ transport.T).reshape(-1, *CAMERA, 1)
    return 65535 * (pictures + 0.03)


def _check(photos, expected):
    # 30 000 electrons: half a percent of noise.
    assert np.abs(photos - expected).max() < 0.04 * 65535
    assert np.sqrt(np.mean((photos - expected) ** 2)) < 0.006 * 65535


def test_a_rig_that_is_left_gives_both_devices_back_once(table, monkeypatch):
    closed = []
    monkeypatch.setattr(TableCamera, "close", lambda _camera: closed.append("camera"))
    monkeypatch.setattr(TableScreen, "close", lambda _screen: closed.append("screen"))
    rig, _, _ = table()
    with rig as entered:
        assert entered is rig
        assert closed == []
    rig.close()
    assert closed == ["screen", "camera"]


def test_photos_are_those_of_the_patterns(table, plan, expected):
    rig, _, told = table()
    _check(_photos(rig, plan), expected)
    assert told == []


@pytest.mark.parametrize("late", [0.03, 0.1, 0.4])
def test_a_slow_projector_is_waited_for(table, plan, expected, late):
    rig, _, told = table(late=late)
    _check(_photos(rig, plan), expected)
    assert told == []


def test_a_projector_that_never_follows_is_named(table, plan):
    rig, _, _ = table(late=5.0)
    with pytest.raises(DeviceError, match=r"do not follow the patterns|looks like black"):
        _photos(rig, plan)


# Frames of the handshake come first.
@pytest.mark.parametrize("fault", ["lost", "repeated", "torn"])
@pytest.mark.parametrize("at", [9, 10, 23, 40, 55, 68])
def test_a_bad_frame_is_taken_again(table, plan, expected, fault, at):
    rig, camera, told = table()
    camera.wrong = {at: fault}
    _check(_photos(rig, plan), expected)
    assert len(told) <= 1
    if told:
        assert "was taken again" in told[0]


def test_most_bad_frames_are_told(table, plan, expected):
    rig, camera, told = table()
    camera.wrong = {at: ("repeated", "torn", "lost")[at % 3] for at in range(12, 60, 7)}
    _check(_photos(rig, plan), expected)
    assert len(told) >= 6


def test_a_camera_that_repeats_for_ever_is_named(table, plan):
    rig, camera, _ = table()
    frames = rig.shoot(plan.draw(i) for i in range(len(plan.patterns)))
    for _ in range(10):
        next(frames)
    old = camera.before
    camera.from_now_on = lambda _picture: old
    with pytest.raises(DeviceError, match=r"photo 10 could not be taken: it is the photo before"):
        list(frames)


def test_a_camera_that_sends_nothing_is_named(table, plan):
    rig, camera, _ = table()
    frames = rig.shoot(plan.draw(i) for i in range(len(plan.patterns)))
    next(frames)
    camera.from_now_on = "lost"
    with pytest.raises(DeviceError, match=r"lost\. It was tried 6 times"):
        list(frames)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda picture: picture + 0.1, r"ambient light changed by \+2"),
        (lambda picture: 0.8 * picture, "exposure or lamp changed by -20"),
    ],
)
def test_light_that_changes_is_named_with_the_photos_it_spoils(table, plan, change, word):
    rig, camera, told = table()
    frames = rig.shoot(plan.draw(i) for i in range(len(plan.patterns)))
    for _ in range(30):
        next(frames)
    assert told == []
    camera.from_now_on = change
    list(frames)
    assert len(told) == 1
    assert re.search(word, told[0])
    (spoilt,) = re.findall(r"range\((\d+), (\d+)\)", told[0])
    assert 30 in range(*map(int, spoilt))


def test_an_exposure_that_changes_by_itself_is_mended(table, plan, expected):
    rig, camera, told = table()
    frames = rig.shoot(plan.draw(i) for i in range(len(plan.patterns)))
    photos = [next(frames) for _ in range(20)]
    camera.device_exposure = 0.05
    photos += list(frames)
    _check(np.stack(photos).astype(np.float64), expected)
    assert any("exposed 0.05 s instead of 0.1 s" in alarm for alarm in told)


def test_light_that_does_not_add_up_is_told(table, plan):
    rig, _, told = table(gamma=2.2)
    _photos(rig, plan)
    assert "127 and 128 of 255 together give 4" in told[0]
    assert "nearfar calibrate" in told[0]


def test_a_camera_too_coarse_for_the_patterns_says_so_once(plan):
    # Every camera pixel sees all of the projector.
    screen = TableScreen()
    flat = np.full((CAMERA.pixels, PROJECTOR.pixels), 0.7 / PROJECTOR.pixels)
    camera = TableCamera(screen, flat, CAMERA, PROJECTOR)
    rig = RealRig(screen, camera, PROJECTOR, exposure=0.1)
    _photos(rig, plan)
    assert sum("hardly resolves them" in alarm for alarm in rig.alarms) == 1
    assert len(rig.alarms) == 1


def test_exposures_are_whole_refreshes(table):
    for wanted in (0.001, 0.02, 0.05, 0.1234):
        rig, camera, told = table({"exposure": wanted})
        turns = camera.exposure * 60
        assert turns == pytest.approx(max(1, round(wanted * 60)))
        assert rig.describe()["exposure"] == camera.exposure
        assert told == []


def test_the_exposure_is_chosen_by_white(table):
    for unit in (0.04, 0.1, 1.0):
        rig, camera, _ = table({"exposure": None}, unit=unit)
        white = rig.photograph(rig.frame(255))
        assert 0.55 < np.quantile(white, 0.999) / 65535 < 0.95, (unit, camera.exposure)


def test_white_that_cannot_be_exposed_for_is_named(table):
    with pytest.raises(DeviceError, match="saturated by white"):
        table({"exposure": None}, unit=1e-4)
    with pytest.raises(DeviceError, match="next to nothing"):
        table({"exposure": None}, unit=1e4)


def test_a_dark_projector_is_named(table, plan):
    rig, camera, _ = table()
    camera.from_now_on = lambda picture: 0 * picture
    with pytest.raises(DeviceError, match="turn the projector on"):
        _photos(rig, plan)


def test_a_pattern_that_does_not_fit_is_refused(transport):
    screen = TableScreen(Size(10, 10))
    camera = TableCamera(screen, transport, CAMERA, PROJECTOR)
    with pytest.raises(InputError, match="does not fit"):
        RealRig(screen, camera, PROJECTOR)


def test_a_capture_remembers_conditions_and_alarms(table, plan, tmp_path):
    rig, camera, _ = table()
    camera.wrong = {30: "repeated"}
    taken = acquire(plan, tmp_path / "c.zarr", rig)
    again = open_capture(tmp_path / "c.zarr")
    assert taken.alarms == again.alarms
    assert len(again.alarms) == 1
    assert again.exposure == 0.1
    assert len(again.conditions["temperature"]) == len(plan.patterns)
    assert all(30 < t < 31 for t in again.conditions["temperature"])
    assert again.rig["projector"]["monitor"] == "table"
    told = run_nearfar("info", tmp_path / "c.zarr").out
    assert "temperature: 30." in told
    assert "alarm: photo" in told


def test_averages_and_brackets_have_less_noise(transport):
    screen = TableScreen()
    noise = {}
    for name, options in (
        ("one", {}),
        ("four", {"frames": 4}),
        ("bracket", {"bracket": (1.0, 4.0, 16.0)}),
    ):
        camera = TableCamera(screen, transport, CAMERA, PROJECTOR, **options)
        rig = RealRig(screen, camera, PROJECTOR, exposure=0.1)
        dim = [rig.photograph(rig.frame(10)) for _ in range(2)]
        noise[name] = np.std(dim[0].astype(float) - dim[1])
        bright = rig.photograph(rig.frame(255))
        assert bright.max() <= 65535
    assert noise["four"] == pytest.approx(noise["one"] / 2, rel=0.15)
    # 21 times the light; read noise and levels of the shortest hardly count.
    assert noise["bracket"] < noise["one"] / 3.5


def test_brackets_and_averages_show_the_same_light(transport):
    screen = TableScreen()
    levels = {}
    for name, options in (("one", {}), ("four", {"frames": 4}), ("bracket", {"bracket": BRACKET})):
        camera = TableCamera(screen, transport, CAMERA, PROJECTOR, **options)
        camera.sensor = Sensor(0.02 * 65535, 65535 / 30_000, 4 * 65535 / 30_000)
        rig = RealRig(screen, camera, PROJECTOR, exposure=0.1)
        levels[name] = [
            np.mean([rig.photograph(rig.frame(v)) for _ in range(4)]) for v in (0, 10, 127, 255)
        ]
    white = levels["one"][-1] - levels["one"][0]
    for name in ("four", "bracket"):
        np.testing.assert_allclose(levels[name], levels["one"], atol=1e-3 * white)


def test_stripes_are_no_tears(transport):
    screen = TableScreen()
    camera = TableCamera(screen, transport, CAMERA, PROJECTOR)
    rig = RealRig(screen, camera, PROJECTOR, exposure=0.1)
    plan = paper_plan(PROJECTOR, 3, Size(3, 3))
    camera.wrong = {60: "repeated"}
    _photos(rig, plan)
    assert len(rig.alarms) == 1
    assert "was taken again" in rig.alarms[0]
    # And no more frames than it needs: nine to begin with, two for the one that came twice.
    assert camera.taken <= len(plan.patterns) + 9 + 2 + 6


def test_rows_that_see_no_direct_light_are_no_tears(transport, plan):
    # The camera sees more than the projector lights.
    dark = np.repeat(transport.mean(axis=0, keepdims=True), 8 * CAMERA.width, axis=0)
    tall = Size(CAMERA.height + 8, CAMERA.width)
    screen = TableScreen()
    camera = TableCamera(screen, np.concatenate([dark, transport]), tall, PROJECTOR)
    rig = RealRig(screen, camera, PROJECTOR, exposure=0.1)
    camera.wrong = {40: "torn", 50: "repeated"}
    _photos(rig, plan)
    assert len(rig.alarms) == 2
    assert all("was taken again" in alarm for alarm in rig.alarms)


def test_a_bad_frame_after_light_that_changed_is_taken_again(table, plan, expected):
    rig, camera, told = table()
    frames = rig.shoot(plan.draw(i) for i in range(len(plan.patterns)))
    photos = [next(frames) for _ in range(30)]
    frame = camera.taken
    camera.from_now_on = lambda picture: picture + 0.1
    camera.wrong = {frame + 3: "repeated"}
    photos += list(frames)
    assert any("ambient light changed" in alarm for alarm in told), told
    later = np.stack(photos[40:]).astype(np.float64) - 0.1 * 65535
    _check(later, expected[40:])


def test_a_response_that_is_not_linear_is_not_taken_for_light_that_changes(table):
    rig, camera, told = table(gamma=2.2)
    plan = paper_plan(PROJECTOR, 3, Size(3, 3))
    _photos(rig, plan)
    assert not any("shoot_again" in alarm for alarm in told)
    assert sum("the response is not linear" in alarm for alarm in told) == 1
    assert camera.taken < len(plan.patterns) + 9 + 12


def test_a_small_part_of_the_view_is_enough(transport, plan):
    small = np.zeros((40 * CAMERA.pixels, PROJECTOR.pixels))
    small[: CAMERA.pixels] = transport
    size = Size(40 * CAMERA.height, CAMERA.width)
    screen = TableScreen()
    dim = SimulatedCamera(bits=12, read_noise=60.0)
    camera = TableCamera(screen, 0.3 * small, size, PROJECTOR, sensor=dim)
    RealRig(screen, camera, PROJECTOR, exposure=0.1).synchronise()


def test_photos_of_floats_are_as_good(table, plan, expected):
    rig, camera, told = table()
    take = camera.take
    camera.take = lambda: (take() / 65535).astype(np.float32)
    type(camera).full_scale, whole = property(lambda _self: 1.0), type(camera).full_scale
    try:
        photos = _photos(rig, plan)
    finally:
        type(camera).full_scale = whole
    _check(65535 * photos, expected)
    assert told == []


def test_a_photo_of_another_size_is_taken_again(table, plan, expected):
    rig, camera, told = table()
    take = camera.take
    camera.take = lambda: take()[: 5 if camera.taken == 30 else None]
    _check(_photos(rig, plan), expected)
    assert "leave the camera's settings" in told[0]


def test_a_lost_frame_does_not_end_the_choice_of_exposure(transport):
    screen = TableScreen()
    camera = TableCamera(screen, transport, CAMERA, PROJECTOR)
    camera.wrong = {0: "lost", 2: "lost"}
    RealRig(screen, camera, PROJECTOR)
    assert camera.exposure is not None


def test_alarms_of_a_capture_that_is_gone_on_with_name_its_own_photos(table, plan):
    rig, camera, told = table()
    patterns = [plan.draw(i) for i in range(31, len(plan.patterns))]
    frames = rig.shoot(patterns, 31)
    next(frames)
    camera.from_now_on = lambda picture: picture + 0.1
    list(frames)
    assert "numbers=range(3" in told[0]


def test_gray_code_is_photographed_where_the_camera_sees_few_of_its_stripes():
    # A quarter of the projector, where coarse bits are as black, or as white, as the photo before.
    screen, seen = TableScreen(Size(24, 32)), Size(12, 16)
    direct = np.zeros((*seen, *screen.monitor.size))
    y, x = np.indices(seen)
    direct[y, x, y, x + 16] = 0.4
    transport = direct.reshape(seen.pixels, -1)
    camera = TableCamera(screen, transport, seen, screen.monitor.size)
    rig = RealRig(screen, camera, screen.monitor.size, scale=1, exposure=0.1)
    gray = paper_plan(rig.projector, 1, Size(1, 1), correspondence="gray")
    photos = _photos(rig, gray)[..., 0]
    patterns = [gray.draw(i)[:12, 16:] for i in range(len(gray.patterns))]
    shown = np.array(patterns, dtype=float)
    assert np.corrcoef(shown.ravel(), photos.ravel())[0, 1] > 0.999
