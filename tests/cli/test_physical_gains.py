"""Gains of direct light, subsurface light and inter-reflection by the command line."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar import load_transport, save_transport
from nearfar.estimate.physical import split_physically
from tests.cli.conftest import check_done, run_nearfar
from tests.estimate.physical.test_split import (
    ATTENUATION,
    PROJECTOR,
    transport_of,
    window_light,
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A disc of wax beside a wall that lights from one side, and lights of either sort."""
    folder = tmp_path_factory.mktemp("wax")
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    disc = (np.hypot(y - 15, x - 16) < 6).astype(float)
    near = window_light(disc, attenuations=(ATTENUATION, 1.5 * ATTENUATION))
    near[:, :3, :, :2] += 0.01
    generator = np.random.default_rng(4)
    direct = generator.uniform(0.05, 0.3, (*PROJECTOR, 2))
    of_two_channels = transport_of(near, direct)
    factors = ("direct", "near", "far", "black", "noise")
    coloured = {name: getattr(of_two_channels, name)[:, :, [0, 1, 1]] for name in factors}
    save_transport(replace(of_two_channels, **coloured), folder / "t.zarr")
    np.save(folder / "grey.npy", generator.random(PROJECTOR, dtype=np.float32))
    np.save(folder / "colour.npy", generator.random((*PROJECTOR, 3), dtype=np.float32))
    return folder


def relit(folder, light, *gains):
    options = [option for gain in gains for option in ("--gain", gain)]
    out = folder / f"{light}-{'-'.join(gains)}-relit.npy"
    check_done(run_nearfar("relight", folder / "t.zarr", folder / f"{light}.npy", out, *options))
    return np.load(out)


@pytest.fixture(scope="module")
def split(folder):
    return split_physically(load_transport(folder / "t.zarr"))


def test_one_component_makes_a_picture_under_coloured_light(folder, split):
    direct, subsurface, rest = split.components(np.load(folder / "colour.npy"))
    assert subsurface.sum() > 0.05 * direct.sum()
    assert rest.max() > 0.02
    found = relit(folder, "colour", "direct=0", "subsurface=1", "interreflection=0")
    np.testing.assert_allclose(found, subsurface, atol=1e-6)


def test_a_gain_is_that_of_its_component(folder, split):
    direct, subsurface, rest = split.components(np.load(folder / "grey.npy"))
    found = relit(folder, "grey", "direct=3", "subsurface=2", "interreflection=0.5")
    np.testing.assert_allclose(found, 3 * direct + 2 * subsurface + 0.5 * rest, atol=1e-6)


def test_gains_of_1_change_nothing(folder, split):
    light = np.load(folder / "colour.npy")
    found = relit(folder, "colour", "subsurface=1")
    np.testing.assert_allclose(found, split.transport @ light, atol=1e-6)


def test_direct_light_alone_is_the_models(folder, split):
    """Under wax the two differ: some subsurface light stands at q."""
    light = np.load(folder / "grey.npy")
    by_model = split.transport.relight(light, direct=0)
    assert np.abs(by_model - split.relight(light, direct=0)).max() > 1e-3
    np.testing.assert_allclose(relit(folder, "grey", "direct=0"), by_model, atol=1e-6)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--gain", "near=2", "--gain", "subsurface=2"), ("direct, near, far", "two splits")),
        (("--gain", "interreflection=0", "--gain", "far=0"), ("direct, subsurface,", "far")),
        (("--gain", "free=1", "--gain", "subsurface=2"), ("free", "two splits")),
        (("--gain", "subsurface=two"), ("interreflection=0",)),
        (("--gain", "subsurface=1", "--gain", "subsurface=2"), ("subsurface is given twice",)),
    ],
)
def test_what_does_not_go_together_is_wrong_usage(folder, options, named):
    out = folder / "refused.npy"
    ran = run_nearfar("relight", folder / "t.zarr", folder / "grey.npy", out, *options)
    assert ran.status == 2
    said = " ".join(ran.err.replace("│", " ").split())
    for name in named:
        assert name in said
    assert not out.exists()


def test_error_bars_of_physical_components_need_those_of_the_transport(folder):
    out = folder / "bars.npy"
    gains = ("--gain", "subsurface=2", "--error-bars")
    ran = run_nearfar("relight", folder / "t.zarr", folder / "grey.npy", out, *gains)
    assert ran.status == 1
    assert "holds no error bars" in ran.err
    assert not out.exists()
