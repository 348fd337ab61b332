"""Scene files: what is replaced in them, what stays, and what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError, MissingFileError, NearfarError, UnreadableFileError
from nearfar.files import write_picture
from nearfar.scenes.mitsuba.loading import load_scene
from nearfar.scenes.mitsuba.photos import RenderedWorld
from tests.scenes.mitsuba import descriptions as d

GRID = Size(4, 5)
SQUARE = Size(4, 4)
DIRECT = d.integrator("path", 2)


def _white(loaded, samples: int = 256, seed: int = 0) -> np.ndarray:
    return RenderedWorld(loaded, samples, seed).pictures(np.ones((1, *loaded.projector)))[0]


def test_sizes_and_samples_are_the_scenes_own(write):
    loaded = load_scene(write(d.scene()), SQUARE)
    assert (loaded.camera, loaded.channels, loaded.samples) == (Size(16, 16), 3, 64)
    assert (loaded.integrator, loaded.settings["max_depth"]) == ("path", 6)
    assert loaded.notes == ()


def test_another_camera_sees_the_same_field(write):
    path = write(d.scene(method=DIRECT))
    own = _white(load_scene(path, SQUARE), 4096)
    finer = _white(load_scene(path, SQUARE, Size(32, 32)), 1024)
    # A box filter makes a camera pixel the mean over its area, so finer ones add up to it.
    summed = finer.reshape(16, 2, 16, 2, 3).mean(axis=(1, 3))
    assert np.abs(summed - own).mean() < 0.03 * own.mean()


def test_a_pattern_is_constant_over_each_projector_pixel(write):
    """A coarse pattern is the fine one with each pixel repeated."""
    path = write(d.scene(method=DIRECT))
    coarse = np.random.default_rng(0).uniform(size=SQUARE)
    fine = coarse.repeat(3, axis=0).repeat(3, axis=1)
    one = RenderedWorld(load_scene(path, SQUARE), 2048).pictures(coarse[None])
    other = RenderedWorld(load_scene(path, Size(12, 12)), 2048).pictures(fine[None])
    # The same seeds draw the same paths.
    np.testing.assert_allclose(one, other, rtol=1e-4, atol=1e-4)


def test_the_projectors_white_is_its_plain_colour(write):
    floodlit = {}
    for colour in ("1 1 1", "1 0.5 0.25"):
        text = d.scene(method=DIRECT, picture=f'<rgb name="irradiance" value="{colour}"/>')
        loaded = load_scene(write(text), SQUARE)
        np.testing.assert_allclose(loaded.white, [float(part) for part in colour.split()])
        floodlit[colour] = _white(loaded)
    white, tinted = floodlit.values()
    np.testing.assert_allclose(tinted, white * [1, 0.5, 0.25], rtol=1e-4, atol=1e-5)


def test_a_picture_gives_the_grid_its_size(write, tmp_path: Path):
    write_picture(tmp_path / "slide.png", np.zeros((6, 9), np.float32))
    picture = (
        '<texture name="irradiance" type="bitmap"><string name="filename" value="slide.png"/>'
        "</texture>"
    )
    path = write(d.scene(method=DIRECT, picture=picture))
    loaded = load_scene(path)
    assert loaded.projector == loaded.picture == Size(6, 9)
    assert loaded.notes == ()
    assert _white(loaded).max() > 0
    assert load_scene(path, Size(12, 18)).notes == ()
    (note,) = load_scene(path, SQUARE).notes
    assert "6x9" in note
    assert "4x4" in note


def test_a_grid_of_another_shape_lights_another_field(write):
    path = write(d.scene(method=DIRECT))
    wide = load_scene(path, Size(4, 8))
    assert len(wide.notes) == 1
    # The field of view is given across: half as high, it lights about half.
    lit, whole = (_white(load_scene(path, size)) > 0.05 for size in (Size(4, 8), SQUARE))
    assert 0.35 < lit.sum() / whole.sum() < 0.7


def test_ambient_light_is_in_every_picture(write):
    lit = load_scene(write(d.scene(d.LAMP, method=DIRECT)), SQUARE)
    black = RenderedWorld(lit, 512).pictures(np.zeros((1, *SQUARE)))[0]
    assert black.mean() > 0.01
    without = load_scene(write(d.scene(method=DIRECT)), SQUARE)
    assert RenderedWorld(without, 16).pictures(np.zeros((1, *SQUARE))).max() == 0


def test_pictures_have_fresh_noise_that_a_seed_repeats(write):
    loaded = load_scene(write(d.scene()), SQUARE)
    lights = np.ones((2, *SQUARE))
    world = RenderedWorld(loaded, 16, seed=3)
    first, second = world.pictures(lights)
    assert np.abs(first - second).max() > 1e-3
    assert np.abs(world.pictures(lights)[0] - first).max() > 1e-3
    again = RenderedWorld(loaded, 16, seed=3).pictures(lights)
    np.testing.assert_allclose(again, [first, second], rtol=1e-5, atol=1e-6)
    assert np.abs(RenderedWorld(loaded, 16, seed=4).pictures(lights)[0] - first).max() > 1e-3
    with pytest.raises(InputError, match="4x4"):
        world.pictures(np.ones((1, 3, 3)))
    with pytest.raises(InputError, match="at least 1"):
        RenderedWorld(loaded, 0)


def test_passes_change_nothing_but_noise(write, monkeypatch: pytest.MonkeyPatch):
    loaded = load_scene(write(d.scene(method=DIRECT)), SQUARE)
    whole = _white(loaded, 1000)
    monkeypatch.setattr("nearfar.scenes.mitsuba.photos.SAMPLES_AT_ONCE", 16 * 16 * 300)
    cut = _white(loaded, 1000)
    assert np.abs(whole - cut).max() > 0
    assert np.abs(whole - cut).mean() < 0.03 * whole.mean()


def test_a_scene_without_an_integrator_or_a_film_has_mitsubas_own(write):
    bare = re.sub(r"<film.*</film>", "", d.SENSOR, flags=re.DOTALL)
    loaded = load_scene(write(d.scene(method="", sensor=bare)), SQUARE)
    assert (loaded.integrator, loaded.camera) == ("path", Size(576, 768))


CROPPED = d.SENSOR.replace("<rfilter", '<integer name="crop_width" value="8"/><rfilter')
SPECTRAL = d.SENSOR.replace('film type="hdrfilm"', 'film type="specfilm"')
REFUSED = {
    "no projector": (d.scene(projector=""), InputError, "no projector"),
    "two projectors": (
        d.scene(projector=d.PROJECTOR + d.PROJECTOR),
        InputError,
        "2 projectors: leave one",
    ),
    "no sensor": (d.scene(sensor=""), InputError, "no sensor"),
    "two sensors": (d.scene(sensor=d.SENSOR + d.SENSOR), InputError, "2 sensors: leave one"),
    "crop": (d.scene(sensor=CROPPED), InputError, "crops its film"),
    "spectral film": (d.scene(sensor=SPECTRAL), InputError, "specfilm: use an hdrfilm"),
    "derivatives": (d.scene(method=d.integrator("prb")), InputError, "prb.*: use path"),
    "no scene": ('<bsdf version="3.0.0" type="diffuse"/>', InputError, "no scene"),
    "broken": (d.scene()[:-9], UnreadableFileError, "cannot be loaded by Mitsuba"),
    "empty": ("", UnreadableFileError, "cannot be loaded by Mitsuba"),
    "no xml": ("\x01\x02 scene", UnreadableFileError, "cannot be loaded by Mitsuba"),
    "no version": (d.scene().replace(' version="3.0.0"', ""), UnreadableFileError, "version"),
    "unknown plug-in": (d.scene('<shape type="spere"/>'), UnreadableFileError, "spere"),
    "unknown key": (
        d.scene('<shape type="sphere"><float name="raius" value="1"/></shape>'),
        UnreadableFileError,
        "raius",
    ),
    "missing mesh": (
        d.scene('<shape type="obj"><string name="filename" value="gone.obj"/></shape>'),
        UnreadableFileError,
        "gone.obj",
    ),
    "missing reference": (
        d.scene('<shape type="sphere"><ref id="gone"/></shape>'),
        UnreadableFileError,
        "gone",
    ),
    "missing slide": (
        d.scene(
            picture='<texture name="irradiance" type="bitmap">'
            '<string name="filename" value="gone.png"/></texture>'
        ),
        UnreadableFileError,
        "gone.png",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_bad_scenes_get_a_sentence(write, kind: str):
    text, error, words = REFUSED[kind]
    path = write(text)
    with pytest.raises(NearfarError, match=words) as caught:
        load_scene(path, SQUARE)
    sentence = str(caught.value)
    assert isinstance(caught.value, error)
    assert str(path) in sentence
    assert ": " in sentence
    assert "\n" not in sentence
    assert sentence.endswith(".")


def test_a_scene_that_is_not_there(tmp_path: Path):
    with pytest.raises(MissingFileError, match="is not there"):
        load_scene(tmp_path / "gone.xml", SQUARE)
    with pytest.raises(MissingFileError, match="is not there"):
        load_scene(tmp_path, SQUARE)


def test_a_projector_without_a_picture_needs_a_size(write):
    with pytest.raises(InputError, match="give the projector's size"):
        load_scene(write(d.scene()))
