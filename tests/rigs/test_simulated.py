"""The simulated rig: each part as specified, noise as physics has it."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError, MissingFileError, UnreadableFileError
from nearfar.plan import paper_plan
from nearfar.rigs.opening import open_rig
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.drift import SimulatedDrift
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact_store import save_exact
from nearfar.transport.store import save_transport
from tests.estimate.test_fit import _exact_of
from tests.worlds import model_transport

SIZE = Size(12, 14)
RAMP = np.arange(256, dtype=np.uint8).reshape(16, 16)


def test_white_less_black_is_one_whatever_the_projector():
    for optics in (
        SimulatedProjector(),
        SimulatedProjector(gamma=2.2),
        SimulatedProjector(black_level=0.02),
        SimulatedProjector(black_level=0.1, gamma=1.8),
    ):
        light = optics.emit(RAMP)
        assert light.max() - light.min() == pytest.approx(1.0, abs=1e-6)
        assert np.all(np.diff(light.ravel()) >= 0)


def test_a_projectors_black_is_its_share_of_white():
    light = SimulatedProjector(black_level=0.02).emit(RAMP)
    assert light.min() / light.max() == pytest.approx(0.02, rel=1e-5)
    assert SimulatedProjector(gamma=2.2).emit(RAMP)[8, 0] == pytest.approx((128 / 255) ** 2.2)


def test_noise_has_the_variance_of_light_and_of_reading():
    camera = SimulatedCamera(ambient=0.0)
    generator = np.random.default_rng(0)
    for electrons in (0.0, 300.0, 25_000.0):
        read = camera.noise(np.full(200_000, electrons), generator)
        assert read.mean() == pytest.approx(electrons, abs=4 * np.sqrt(electrons + 16) / 400)
        assert read.var() == pytest.approx(electrons + 16, rel=0.02)


@pytest.mark.parametrize("bits", [8, 10, 14, 16])
def test_the_sensor_counts_to_its_full_scale(bits):
    camera = SimulatedCamera(bits=bits, black_level=0.0)
    levels = camera.sensor(np.linspace(-1000, 40_000, 5000))
    assert levels.min() == 0
    assert levels.max() == camera.full_scale == 2**bits - 1
    assert levels.dtype == (np.uint8 if bits == 8 else np.uint16)
    inner = np.linspace(0, 30_000, 5000)
    back = camera.sensor(inner) / camera.full_scale * camera.full_well
    assert np.abs(back - inner).max() <= 0.5 * camera.full_well / camera.full_scale + 1e-6


def test_a_photo_is_light_ambient_and_black_level():
    camera = SimulatedCamera(read_noise=0, shot_noise=False, bits=16)
    photo = camera.photograph(np.full((3, 3, 1), 0.5), np.random.default_rng(0))
    np.testing.assert_allclose(photo / 65535, 0.5 + 0.01 + 0.02, atol=1e-5)


def test_photos_follow_from_seed_and_number_alone():
    world = model_transport(SIZE, Size(5, 5), window=5, far=Size(3, 3))
    plan = paper_plan(SIZE, 5, Size(3, 3))
    drawn = [plan.draw(i) for i in range(40)]

    def shot(seed, patterns):
        rig = SimulatedRig(world, "w", SimulatedProjector(), SimulatedCamera(), 1.0, seed)
        return list(rig.shoot(iter(patterns)))

    first = shot(1, drawn)
    # Batches are an inner matter: fewer patterns, the same photos.
    for one, other in zip(first, shot(1, drawn[:35]), strict=False):
        np.testing.assert_array_equal(one, other)
    assert any(not np.array_equal(a, b) for a, b in zip(first, shot(2, drawn), strict=True))


def test_exposure_scales_light_but_not_ambient():
    world = model_transport(SIZE, Size(5, 5), window=5, far=Size(3, 3))
    camera = SimulatedCamera(read_noise=0, shot_noise=False, bits=16)
    white = np.full(SIZE, 255, np.uint8)
    photos = [
        next(SimulatedRig(world, "w", SimulatedProjector(), camera, e, 0).shoot([white]))
        for e in (0.5, 1.0)
    ]
    light = [photo / 65535 - 0.03 for photo in photos]
    np.testing.assert_allclose(light[1], 2 * light[0], atol=5e-5)


def test_lamp_and_ambient_drift_from_photo_to_photo():
    world = model_transport(SIZE, Size(5, 5), window=5, far=Size(3, 3))
    lamp = SimulatedDrift(per_100_photos=-0.5, swing=0.1, period=16)
    ambient = SimulatedDrift(per_100_photos=2.0)
    optics = SimulatedProjector(lamp_drift=lamp)
    camera = SimulatedCamera(read_noise=0, shot_noise=False, bits=16, ambient_drift=ambient)
    white = np.full(SIZE, 255, np.uint8)
    photos = list(SimulatedRig(world, "w", optics, camera, 1.0, 0).shoot([white] * 40))
    light = (world @ np.ones(SIZE))[..., None]
    # More than a batch, so that numbers run on.
    for number in (0, 4, 31, 32, 39):
        share = 1 - 0.005 * number + 0.1 * np.sin(2 * np.pi * number / 16)
        expected = light * share + 0.01 * (1 + 0.02 * number) + 0.02
        np.testing.assert_allclose(photos[number] / 65535, expected, atol=1e-5)


def test_a_light_is_never_less_than_none():
    assert SimulatedDrift(per_100_photos=-1.0).at(250) == 0.0


def _stored(tmp_path, scale=1.0):
    world = model_transport(SIZE, SIZE, window=5, far=Size(3, 3)).with_gains(
        direct=scale, near=scale, far=scale
    )
    peak = float((world @ np.ones(SIZE)).max())
    save_transport(world, tmp_path / "measured.zarr")
    exact = _exact_of(world)
    save_exact(exact, tmp_path / "exact.zarr")
    np.save(tmp_path / "dense.npy", exact.rows(slice(None))[:, 0])
    return world, peak


@pytest.mark.parametrize("name", ["measured.zarr", "exact.zarr", "dense.npy"])
def test_a_stored_transport_is_a_rig(tmp_path, name):
    world, _ = _stored(tmp_path)
    rig = open_rig(str(tmp_path / name), SIZE)
    # It is in photo units already: taken as it is.
    assert rig.exposure == 1.0
    light = np.random.default_rng(0).random(SIZE).astype(np.float32)
    np.testing.assert_allclose(rig.world.pictures(light[None])[0, ..., 0], world @ light, atol=1e-5)


@pytest.mark.parametrize("scale", [1e-3, 40.0])
def test_other_units_are_exposed_for(tmp_path, scale):
    _, peak = _stored(tmp_path, scale)
    rig = open_rig(str(tmp_path / "exact.zarr"), SIZE)
    assert rig.exposure * peak == pytest.approx(0.9, rel=1e-4)
    assert rig.describe()["transport_exposure"] == rig.exposure


def test_a_rig_file_says_everything(tmp_path):
    _, peak = _stored(tmp_path)
    (tmp_path / "rig.toml").write_text(
        'exposure = "auto"\nseed = 7\n[scene]\ntransport = "dense.npy"\ncamera = "12x14"\n'
        "[projector]\nblack_level = 0.01\ngamma = 2.2\n"
        "lamp_drift = { per_100_photos = -0.03, swing = 0.01, period = 50 }\n"
        "[camera]\nfull_well = 1000\nread_noise = 2\nbits = 10\nblack_level = 0.0\nambient = 0.0\n"
        "ambient_drift = { per_100_photos = 0.5 }\n"
    )
    rig = open_rig(str(tmp_path / "rig.toml"), SIZE)
    assert rig.seed == 7
    assert rig.optics.gamma == 2.2
    assert rig.optics.lamp_drift == SimulatedDrift(per_100_photos=-0.03, swing=0.01, period=50)
    assert rig.sensor.ambient_drift.at(200) == 2.0
    assert rig.describe()["camera"]["ambient_drift"]["per_100_photos"] == 0.5
    assert rig.full_scale == 1023
    assert rig.exposure * peak == pytest.approx(0.9, rel=1e-4)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "scene"),
        ("[scene]\n", "either name"),
        ('[scene]\nname = "cornell"\ntransport = "x.npy"\n', "either name"),
        ('[scene]\nname = "cornell"\n[camera]\nbits = 99\n', "camera.bits"),
        ('[scene]\nname = "cornell"\n[camera]\nlens = 1\n', "camera.lens"),
        ('[scene]\nname = "wedge"\n[projector]\nlamp_drift = { slope = 1 }\n', "lamp_drift.slope"),
        (
            '[scene]\nname = "wedge"\n[camera]\nambient_drift = { period = 0 }\n',
            "ambient_drift.period",
        ),
        ("scene = [\n", "cannot be read as a rig"),
    ],
)
def test_a_rig_file_that_is_wrong_gets_a_sentence(tmp_path, text, message):
    (tmp_path / "rig.toml").write_text(text)
    with pytest.raises(UnreadableFileError, match=message):
        open_rig(str(tmp_path / "rig.toml"), SIZE)


def test_no_rig_of_that_name(tmp_path):
    with pytest.raises(MissingFileError, match="name a scene"):
        open_rig("teapot", SIZE)
    with pytest.raises(MissingFileError, match=r"rig\.toml is not there"):
        open_rig(str(tmp_path / "rig.toml"), SIZE)


def test_a_rig_of_another_projector_is_refused(tmp_path):
    _stored(tmp_path)
    with pytest.raises(InputError, match=r"`projector=\(12, 14\)`"):
        open_rig(str(tmp_path / "exact.zarr"), Size(14, 12))
