"""Shifts of q, on rows that are given."""

from types import SimpleNamespace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.estimate.joint.shifts import moved_q
from nearfar.estimate.joint.spikes import around_q
from nearfar.illumination.near_basis import NearBasis

PROJECTOR, WINDOW, DIRECT = Size(20, 24), 5, 0.5


def shifted(off, next_to_q, *, pitch=1, channels=2):
    """Return q before and after a sweep that finds it off by `off` (C, 2).

    Near-range light next to q is this share of direct light.
    """
    off = np.asarray(off, dtype=float)
    count = len(off)
    q = np.stack([np.linspace(4.2, 14.2, count), np.linspace(5.3, 17.3, count)], axis=-1)
    amplitudes = np.zeros((count, channels, 4))
    amplitudes[..., 1] = DIRECT
    amplitudes[..., 2:] = DIRECT * off[:, None]
    near = np.zeros((count, channels, WINDOW**2), dtype=np.float32)
    near[..., around_q(WINDOW)] = DIRECT * next_to_q / 9
    problem = SimpleNamespace(
        near_basis=NearBasis(WINDOW, pitch),
        pixels=SimpleNamespace(correspondence=q, centres=np.rint(q).astype(int)),
        measurements=SimpleNamespace(projector=PROJECTOR),
    )
    rows = SimpleNamespace(amplitudes=amplitudes, near=near)
    return q, moved_q(problem, rows, np.ones(count, bool), is_last=True)


def test_q_takes_up_small_errors_where_all_is_direct_light():
    off = np.array([[0.02, -0.03], [0.0, 0.05], [-0.08, 0.01]])
    q, moved = shifted(off, next_to_q=0.05)
    np.testing.assert_allclose(moved, q + off, atol=1e-12)


@pytest.mark.parametrize("share", [0.15, 2.0, -0.5])
def test_beside_near_range_light_q_takes_up_large_errors_alone(share):
    off = np.array([[0.02, -0.03], [0.0, 0.09], [0.15, 0.01], [0.01, 0.14]])
    q, moved = shifted(off, next_to_q=share)
    np.testing.assert_array_equal(moved[:2], q[:2])
    np.testing.assert_allclose(moved[2:], q[2:] + off[2:], atol=1e-12)


def test_before_fine_projectors_every_error_is_taken_up():
    off = np.array([[0.02, -0.03], [0.0, 0.09]])
    q, moved = shifted(off, next_to_q=2.0, pitch=2)
    np.testing.assert_allclose(moved, q + off, atol=1e-12)
