"""What the figures draw is what was measured."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.evaluate import snr, snr_of_rows
from tests.report.figures.conftest import BOX

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", ["box", "corner", "wedge"])
def test_components_add_up_and_snr_is_of_the_pictures_shown(measured_once, name):
    data = measured_once[name]
    for light in ("white", "picture"):
        parts = [data.arrays[f"{light}/{part}"] for part in ("direct", "near", "far")]
        np.testing.assert_allclose(sum(parts), data.arrays[f"{light}/sum"], atol=1e-6)
        found = snr(data.arrays[f"{light}/exact"], data.arrays[f"{light}/sum"])
        # Pictures are kept as float32.
        assert found == pytest.approx(data.numbers["snr_b"][light], abs=0.01 if found < 100 else 10)
    assert data.arrays["snr_t"].min() == pytest.approx(data.numbers["snr_t"]["p0"], abs=1e-3)
    lowest = data.numbers["snr_b_frequency"]["p0"]
    assert data.arrays["snr_b"].min() == pytest.approx(lowest, abs=1e-3)


def test_the_lowest_are_where_it_says(measured_once):
    data = measured_once["wedge"]
    y, x = data.numbers["lowest_camera_pixel"]
    assert data.arrays["snr_t"][y, x] == data.arrays["snr_t"].min()
    ky, kx = data.numbers["lowest_frequency"]
    middle = [side // 2 for side in data.numbers["projector"]]
    assert data.arrays["snr_b"][ky + middle[0], kx + middle[1]] == data.arrays["snr_b"].min()
    # The far band is measured itself, and exact without noise.
    assert data.arrays["snr_b"][middle[0], middle[1]] > 100


def test_slices_and_their_singular_values_are_those_of_the_scene(measured_once):
    data = measured_once["scan-line"]
    scene = cached_scene("cornell", BOX.projector)
    y, width = data.numbers["line"], scene.camera.width
    rows = scene.rows(slice(y * width, (y + 1) * width)).mean(axis=1)
    cut = rows[:, y * BOX.projector.width : (y + 1) * BOX.projector.width]
    np.testing.assert_allclose(data.arrays["T"], cut, atol=1e-7)
    parts = sum(data.arrays[name] for name in "DNF")
    np.testing.assert_allclose(parts, data.arrays["T"], atol=1e-7)
    values = np.linalg.svd(cut.astype(float), compute_uv=False)
    np.testing.assert_allclose(data.arrays["T/singular"], values, atol=1e-6)
    rank = np.sum(values > data.numbers["rank_above"] * values[0])
    assert data.numbers["ranks"]["T"] == rank
    assert data.numbers["ranks"]["D"] == BOX.projector.width
    # A row summed down the projector responses as the whole row does at ky = 0.
    c = int(data.arrays["columns"][0])
    whole = np.fft.fft2(rows[c].reshape(BOX.projector))[0]
    np.testing.assert_allclose(np.fft.fft(data.arrays["T/along"][0]), whole, atol=1e-5)


def test_snr_of_rows_is_that_of_each_row():
    scene = cached_scene("wedge", Size(16, 20))
    assert snr_of_rows(scene, scene).min() > 200
    louder = replace(scene, far=scene.far * np.float32(1.1))
    found = snr_of_rows(scene, louder)
    c = 157
    expected = snr(scene.rows(slice(c, c + 1)), louder.rows(slice(c, c + 1)))
    assert found[c] == pytest.approx(expected, abs=1e-3)
