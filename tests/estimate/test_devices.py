"""Estimates by PyTorch are NumPy's: the accelerator's code path, on the processor."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size, beside, fetch
from nearfar.devices import mover
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.paper import estimate
from nearfar.photometry.measure import measure
from nearfar.plan import choose_plan, paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from tests.absent import said_without
from tests.estimate.joint.test_second_places import estimated, rows_of, surfaces
from tests.worlds import model_transport

PROJECTOR, CAMERA, WINDOW = Size(16, 20), Size(16, 20), 5


@pytest.fixture(scope="module")
def torch():
    """PyTorch, which takes seconds to import: not in each process that collects tests."""
    torch = pytest.importorskip("torch", reason="PyTorch is not installed")
    # As for BLAS: more threads than processors wait for one another, and PyTorch's wait busily.
    torch.set_num_threads(1)
    return torch


@pytest.fixture(scope="module")
def devices(torch):
    """Devices of PyTorch: the processor, and an accelerator's own where there is one."""
    return ["torch", "cuda"] if torch.cuda.is_available() else ["torch"]


def _by_paper(measurements, q, plan, device):
    return estimate(measurements, q, plan.window, plan.far, plan.dropped, device=device)


def _jointly(measurements, q, plan, device):
    return estimate_jointly(measurements, q, plan.window, plan.far, device=device, pitch=plan.pitch)


@pytest.mark.parametrize(
    ("by", "offset"), [(_jointly, "reference"), (_jointly, "inverse"), (_by_paper, "inverse")]
)
@pytest.mark.parametrize("between", [False, True])
def test_the_estimate_is_numpys(shoot, devices, by, offset, between):
    world = model_transport(PROJECTOR, CAMERA, window=WINDOW, far=Size(3, 3), channels=2)
    if offset == "reference":
        plan = choose_plan(PROJECTOR, 80, window=WINDOW)[0]
    else:
        plan = paper_plan(PROJECTOR, WINDOW, Size(3, 3))
    measurements = measure(shoot(plan, world, SimulatedCamera()))
    q = world.correspondence.copy()
    if between:
        # Between pixels, so that q is put right; and some without direct light.
        q = np.clip(q + np.random.default_rng(0).uniform(-0.4, 0.4, q.shape), 0, 15)
        q[3:5, 8:16] = np.nan
        q = q.astype(np.float32)
    # What rounding the responses in single precision changes is all that another library may.
    generator = np.random.default_rng(1)
    rounded = measurements.responses * (
        1 + 2e-7 * generator.normal(size=measurements.responses.shape)
    )
    again = replace(measurements, responses=rounded.astype(np.float32))
    ours, shaken = (by(given, q, plan, "cpu") for given in (measurements, again))
    for device in devices:
        _check_as_good(by(measurements, q, plan, device), ours, shaken)


def test_second_places_are_numpys(devices):
    ours = estimated(rows_of(surfaces()), surfaces())
    assert np.isfinite(ours.second_place).any()
    for device in devices:
        theirs = estimated(rows_of(surfaces()), surfaces(), device=device)
        assert theirs.second_place.dtype == ours.second_place.dtype
        np.testing.assert_allclose(theirs.second_place, ours.second_place, atol=1e-5)
        np.testing.assert_allclose(theirs.second_direct, ours.second_direct, atol=1e-5)


def _check_as_good(theirs, ours, shaken):
    """Check an estimate to differ from ours no more than rounded responses make ours differ."""
    if ours.posterior is not None:
        assert np.mean(ours.posterior.prior_component == theirs.posterior.prior_component) > 0.99
    for name in ("direct", "near", "far", "correspondence"):
        one, jolted, other = (np.nan_to_num(getattr(each, name)) for each in (ours, shaken, theirs))
        assert type(other) is np.ndarray
        assert one.dtype == other.dtype
        allowed = 3 * np.sqrt(np.mean((jolted - one) ** 2)) + 1e-6
        assert np.sqrt(np.mean((other - one) ** 2)) < allowed, name
    np.testing.assert_array_equal(np.isnan(ours.correspondence), np.isnan(theirs.correspondence))


def test_arrays_come_and_go(torch):
    values = np.arange(6.0, dtype=np.float32).reshape(2, 3)
    there = mover("torch")(values)
    assert isinstance(there, torch.Tensor)
    np.testing.assert_array_equal(fetch(there), values)
    constant = beside(np.arange(3), there)
    assert isinstance(constant, torch.Tensor)
    assert beside(values, values) is values


def test_a_device_that_is_not_there_is_said(devices):
    values = np.arange(3.0)
    if "cuda" in devices:
        np.testing.assert_array_equal(fetch(mover("cuda")(values)), values)
    else:
        with pytest.raises(InputError, match="no CUDA device"):
            mover("cuda")


def test_without_pytorch_it_is_said():
    program = "from nearfar.devices import mover\nmover('cuda')"
    assert "pip install 'nearfar[torch]'" in said_without("torch", program)
