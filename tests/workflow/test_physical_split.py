"""Physical components beside those of worlds whose components are known."""

import json

import numpy as np
import pytest
from scipy import sparse

from nearfar import save_transport, split_physically
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import save_exact
from nearfar.workflow.judge import describe_units, judge_by_truth
from nearfar.workflow.physical_split import physical_snr
from tests.cli.conftest import check_done, run_nearfar
from tests.estimate.physical.test_split import (
    ATTENUATION,
    PROJECTOR,
    transport_of,
    window_light,
)


@pytest.fixture(scope="module")
def wax():
    """A disc of wax, as a transport of one channel."""
    y, x = np.mgrid[: PROJECTOR.height, : PROJECTOR.width]
    disc = (np.hypot(y - 15, x - 16) < 6).astype(float)
    near = window_light(disc, attenuations=(ATTENUATION, 1.5 * ATTENUATION))
    direct = np.random.default_rng(4).uniform(0.05, 0.3, (*PROJECTOR, 2))
    return transport_of(near, direct)


def known(transport, *, subsurface):
    """Return the exact scene: its window light is subsurface light or inter-reflection."""
    direct, near, _ = (np.moveaxis(part, 1, 0) for part in transport.component_rows(slice(None)))
    none = tuple(sparse.csr_array(channel.shape, dtype=np.float32) for channel in near)
    under = tuple(map(sparse.csr_array, near)) if subsurface else none
    rest = np.zeros_like(near) if subsurface else np.ascontiguousarray(near)
    lit = tuple(map(sparse.csr_array, direct))
    return ExactTransport(transport.projector, transport.camera, lit, under, rest)


@pytest.fixture(scope="module")
def split(wax):
    return split_physically(wax)


def test_components_that_the_scene_does_not_have_are_left_out(wax, split):
    found = physical_snr(split, known(wax, subsurface=True))
    assert set(found.components) == {"direct", "subsurface"}
    assert found.components["direct"] > 30
    assert found.components["subsurface"] > 20
    white = wax.components(np.ones(PROJECTOR, np.float32))
    assert found.subsurface_share == pytest.approx(white.near.sum() / sum(white).sum(), rel=0.1)


def test_units_of_the_truth_are_those_of_the_exposure(wax, split):
    truth = known(wax, subsurface=True)
    other = physical_snr(split, 0.25 * truth, exposure=4.0)
    for name, value in physical_snr(split, truth).components.items():
        assert other.components[name] == pytest.approx(value, abs=0.01)
    assert physical_snr(split, 0.25 * truth).components["direct"] < 0


def test_subsurface_light_that_is_not_there_is_told_as_a_share(wax, split):
    judged = judge_by_truth(wax, known(wax, subsurface=False))
    assert set(judged["physical_split"]) == {"direct", "interreflection"}
    # All of the window's light is taken for subsurface light.
    assert judged["physical_split"]["interreflection"] < 10
    white = wax.components(np.ones(PROJECTOR, np.float32))
    share = judged["false_subsurface_share"]
    assert share == pytest.approx(white.near.sum() / sum(white).sum(), rel=0.1)
    assert f"takes {100 * share:.1f} % of the light" in describe_units(judged)[-1]


def test_the_command_and_its_page_tell_both_splits(wax, tmp_path):
    transport, truth, page = (tmp_path / name for name in ("t.zarr", "truth.zarr", "r.html"))
    save_transport(wax, transport)
    save_exact(known(wax, subsurface=True), truth)
    given = ("evaluate", transport, "--truth", truth)
    found = json.loads(check_done(run_nearfar(*given, "--json", "--report", page)).out)
    assert set(found["physical_split"]) == {"direct", "subsurface"}
    assert "false_subsurface_share" not in found
    assert set(found["snr"]["floodlit"]) == set("DNF")
    text = page.read_text()
    physical, model = text.index("The physical split"), text.index("The model's split")
    assert physical < model
    assert f"{found['physical_split']['subsurface']:.1f} dB" in text[physical:model]
    assert "the scene has none" in text[physical:model]
