"""The viewer's server: regions of the camera picture and maps of error bars, as Python has them."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import middles
from nearfar.errors import InputError
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.physical import PhysicalErrorBars, split_physically
from nearfar.transport.store import save_transport
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.physical import PhysicalRelighting
from nearfar.viewer.tools import region as region_module
from nearfar.viewer.tools import tools_of
from tests.viewer.asking import CAMERA, PROJECTOR, message, refused, unpack

REGION = {"top": 2, "left": 3, "bottom": 9, "right": 14}
INSIDE = np.s_[2:9, 3:14]
# As the sliders of the page.
GAINS = {"direct": 0.5, "near": 2.0, "far": 1.5}


@pytest.fixture(scope="module")
def asked(stored):
    """Ask a tool of the server without its network; gives the header and the arrays."""
    transport = InteractiveTransport(stored)
    physical = PhysicalRelighting(transport)
    tools = tools_of(physical, None)

    def ask(name, light, **header):
        if header.get("split") == "physical":
            physical.prepare()
        *_, found = tools[name](transport, message(light, **header))
        return unpack(found)

    return ask


def _mean_of_pixels(values):
    return values[INSIDE].reshape(-1, 3).mean(axis=0)


def test_a_regions_mean_row_is_the_mean_of_its_pixels_rows(asked, transport, lights):
    header, (near, far, spectrum) = asked("region", lights["random"], **REGION)
    rows = [
        part.reshape(*CAMERA, 3, *PROJECTOR)[INSIDE].mean(axis=2)
        for part in transport.component_rows(slice(None))
    ]
    d, n, f = (part.mean(axis=(0, 1)) for part in rows)
    np.testing.assert_allclose(near, d + n, atol=1e-6)
    np.testing.assert_allclose(far, f, atol=1e-6)
    whole = transport.rows(slice(None)).reshape(*CAMERA, 3, *PROJECTOR)[INSIDE].mean(axis=2)
    np.testing.assert_allclose(near + far, whole.mean(axis=(0, 1)), atol=2e-6)
    power = (np.abs(np.fft.fftshift(np.fft.fft2(whole), axes=(-2, -1))) ** 2).mean(axis=(0, 1))
    np.testing.assert_allclose(spectrum, 10 * np.log10(power / power.max()), atol=0.01)
    assert (header["pixels"], header["spectrum_pixels"]) == (77, 77)
    # One camera pixel of it has no direct light.
    assert (header["without_direct"], header["saturated"]) == (1, 0)
    q = transport.correspondence[INSIDE].reshape(-1, 2)
    np.testing.assert_allclose(header["q"], np.nanmedian(q, axis=0), atol=1e-3)


def test_a_regions_numbers_are_means_and_roots_of_mean_squares(asked, transport, lights):
    header, _ = asked("region", lights["coloured"], **REGION)
    components = transport.components(lights["coloured"])
    for name, part in components._asdict().items():
        np.testing.assert_allclose(header["components"][name], _mean_of_pixels(part), atol=1e-5)
    relit = transport @ lights["coloured"]
    np.testing.assert_allclose(header["light"], _mean_of_pixels(relit), atol=1e-5)
    spread = relit[INSIDE].reshape(-1, 3).std(axis=0)
    np.testing.assert_allclose(header["spread"], spread, rtol=1e-3)
    sigma = ErrorBars(transport).picture(lights["coloured"])
    for given, values in (("sigma", sigma), ("noise", transport.noise)):
        np.testing.assert_allclose(header[given], np.sqrt(_mean_of_pixels(values**2)), rtol=1e-3)


def test_a_large_region_is_taken_in_steps_and_its_spectrum_of_some_pixels(
    asked, transport, lights, monkeypatch
):
    monkeypatch.setattr(region_module, "STEP_VALUES", 130)
    monkeypatch.setattr(region_module, "SPECTRUM_PIXELS", 20)
    everywhere = {"top": 0, "left": 0, "bottom": CAMERA.height, "right": CAMERA.width}
    header, (near, far, spectrum) = asked("region", lights["random"], **everywhere)
    whole = transport.rows(slice(None)).mean(axis=1).reshape(-1, *PROJECTOR)
    np.testing.assert_allclose(near + far, whole.mean(axis=0), atol=2e-6)
    assert (header["pixels"], header["spectrum_pixels"]) == (CAMERA.pixels, 20)
    # Evenly spread over all of them, so that it is much the same.
    chosen = ((np.arange(20) + 0.5) * CAMERA.pixels / 20).astype(int)
    power = (np.abs(np.fft.fftshift(np.fft.fft2(whole[chosen]), axes=(1, 2))) ** 2).mean(axis=0)
    np.testing.assert_allclose(spectrum, 10 * np.log10(power / power.max()), atol=0.01)


def test_saturated_pixels_have_no_say_in_a_regions_error_bar(transport, lights, tmp_path):
    saturated = np.zeros(CAMERA, dtype=bool)
    saturated[4, 5] = True
    path = tmp_path / "t.zarr"
    save_transport(
        replace(transport, quality=replace(transport.quality, saturated=saturated)), path
    )
    there = InteractiveTransport(path)
    tools = tools_of(PhysicalRelighting(there), None)
    *_, found = tools["region"](there, message(lights["white"], **REGION))
    header, _ = unpack(found)
    assert header["saturated"] == 1
    sigma = ErrorBars(transport).picture(lights["white"])[INSIDE][~saturated[INSIDE]]
    np.testing.assert_allclose(header["sigma"], np.sqrt((sigma**2).mean(axis=0)), rtol=1e-3)
    *_, found = tools["error-bars"](there, message(lights["white"]))
    _, (deviation, _) = unpack(found)
    np.testing.assert_array_equal(np.isnan(deviation), saturated)


@pytest.mark.parametrize(
    "sides", [{"bottom": CAMERA.height + 1}, {"right": 3}, {"top": -1}, {"left": 14}]
)
def test_what_is_no_region_gets_a_sentence(address, lights, sides):
    status, said = refused(address, "/tool/region", message(lights["white"], **{**REGION, **sides}))
    assert status == 400
    assert "no region of the camera of 30x42" in said


def test_the_map_of_error_bars_is_that_of_the_relit_picture(asked, transport, lights):
    bars = ErrorBars(transport)
    for gains in ({}, GAINS):
        header, (sigma, relit) = asked("error-bars", lights["coloured"], gains=gains)
        assert not header["coarse"]
        expected = bars.picture(lights["coloured"], **gains).mean(axis=-1)
        np.testing.assert_allclose(sigma, expected, rtol=1e-3)
        light = transport.relight(lights["coloured"], **gains).mean(axis=-1)
        np.testing.assert_allclose(relit, light, atol=1e-5)


def test_a_coarse_map_of_error_bars_has_some_of_the_pixels(asked, transport, lights):
    header, (sigma, _) = asked("error-bars", lights["random"], coarse=True)
    assert header["coarse"]
    step = round(CAMERA.height / len(sigma))
    assert step > 1
    fine = ErrorBars(transport).picture(lights["random"]).mean(axis=-1)
    chosen = fine[np.ix_(*(middles(side, step) for side in CAMERA))]
    np.testing.assert_allclose(sigma, chosen, rtol=1e-4)


def test_the_physical_split_has_its_own(asked, transport, lights):
    split = split_physically(transport)
    gains = {"direct": 0.5, "subsurface": 2.0, "interreflection": 1.5}
    header = {"split": "physical", "gains": gains}
    _, (sigma, relit) = asked("error-bars", lights["random"], **header)
    expected = PhysicalErrorBars(split).picture(lights["random"], **gains).mean(axis=-1)
    np.testing.assert_allclose(sigma, expected, rtol=1e-3, atol=1e-7)
    light = split.relight(lights["random"], **gains).mean(axis=-1)
    np.testing.assert_allclose(relit, light, atol=1e-5)
    header, _ = asked("region", lights["random"], split="physical", **REGION)
    assert header["split"] == "physical"
    for name, part in split.components(lights["random"])._asdict().items():
        np.testing.assert_allclose(header["components"][name], _mean_of_pixels(part), atol=1e-5)


def test_without_error_bars_there_is_no_map_of_them(transport, lights, tmp_path):
    save_transport(replace(transport, posterior=None, verdict=None), tmp_path / "t.zarr")
    there = InteractiveTransport(tmp_path / "t.zarr")
    tools = tools_of(PhysicalRelighting(there), None)
    with pytest.raises(InputError, match="no error bars"):
        next(tools["error-bars"](there, message(lights["white"])))
    *_, found = tools["region"](there, message(lights["white"], **REGION))
    assert unpack(found)[0]["sigma"] is None
