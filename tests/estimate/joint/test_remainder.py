"""What neighbours' photos have in common beyond their estimates."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.estimate.joint import estimate as module
from nearfar.estimate.joint import estimate_by_sweeps, estimate_jointly
from nearfar.estimate.joint.problem import lay_out
from nearfar.estimate.joint.remainder import with_remainder
from nearfar.estimate.joint.sweep import _empty_rows
from nearfar.illumination.frequencies import DC, far_frequencies, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.transport.boxes import box_axes
from nearfar.transport.direct import footprint
from tests.estimate.joint.draws import measured

CAMERA = Size(12, 14)
# W, pitch, projector and q's step: functions of single projector pixels, and of several.
FINE, COARSE = (5, 1, Size(24, 26), 1.0), (5, 4, Size(70, 90), 3.0)
FAR = Size(5, 5)
NOISE = 4e-3
# A ring about q, beyond the window of single pixels, that no prior component has.
RING_RADIUS, RING_WIDTH, RING_LIGHT = 6.0, 0.7, 0.15


def frequencies_of(projector):
    band = far_frequencies(Size(9, 9), projector)
    return [k for k in representatives(band) if k != DC]


def places(step):
    y, x = np.indices(CAMERA)
    return np.stack([6 + step * y, 6 + step * x], axis=-1).astype(float)


def albedo():
    """Return how bright camera pixels are, (C,): from a fifth to all."""
    return np.random.default_rng(4).uniform(0.2, 1.0, CAMERA.pixels)


def rows_of(case, ring=RING_LIGHT):
    """Return rows, (C, P): light from q, and a ring about it."""
    _, pitch, projector, step = case
    q = places(step)
    rows = np.zeros((CAMERA.pixels, *projector))
    if pitch == 1:
        where = footprint(q.reshape(-1, 2), projector)
        np.put_along_axis(rows.reshape(CAMERA.pixels, -1), where.pixels, where.weights, axis=1)
    else:
        axes = box_axes(q, np.tile([step, step, 0, 0], (CAMERA.pixels, 1)), projector)
        for c in range(CAMERA.pixels):
            sides, shares = axes.shares(c)
            rows[c][sides] = shares
    y, x = np.indices(projector)
    for c, (down, across) in enumerate(q.reshape(-1, 2)):
        distance = np.hypot(y - down, x - across) / step
        light = np.exp(-0.5 * ((distance - RING_RADIUS) / RING_WIDTH) ** 2)
        rows[c] = 0.5 * rows[c] + ring * light / light.sum()
    return albedo()[:, None] * rows.reshape(CAMERA.pixels, -1)


def measurements_of(case, rows, channels=1, **options):
    dense = np.repeat(rows[:, None], channels, axis=1)
    given = {"noise": NOISE, "camera": CAMERA, "projector": case[2], **options}
    return measured(dense, frequencies_of(case[2]), **given)


def estimated(case, rows, q=None, **options):
    window, pitch, _, step = case
    q = (places(step) if q is None else q).astype(np.float32)
    return estimate_jointly(measurements_of(case, rows, **options), q, window, FAR, pitch=pitch)


def untouched(problem, rows):
    return rows, np.ones_like(problem.pixels.white)


@pytest.fixture
def without(monkeypatch):
    """Return a function that estimates without the remainder."""

    def estimate(*given, **options):
        with monkeypatch.context() as patched:
            patched.setattr(module, "with_remainder", untouched)
            return estimated(*given, **options)

    return estimate


def errors(case, found, rows, frequencies):
    """Return errors of responses to frequencies, (C, R)."""
    basis = real_basis(frequencies, case[2])
    lights = basis.patterns.reshape(-1, *case[2])
    mine = found.pictures(lights).reshape(len(lights), -1).T
    return mine - rows @ basis.patterns.T


@pytest.mark.parametrize("case", [FINE, COARSE])
def test_what_neighbours_share_is_found_in_their_photos(case, without):
    rows = rows_of(case)
    measured_too = frequencies_of(case[2])
    before, after = (
        errors(case, one(case, rows), rows, measured_too) for one in (without, estimated)
    )
    inner = np.zeros(CAMERA, dtype=bool)
    inner[3:-3, 3:-3] = True
    power = [np.mean(each[inner.ravel()] ** 2) for each in (before, after)]
    assert power[1] < 0.75 * power[0]


@pytest.mark.parametrize("case", [FINE, COARSE])
def test_no_other_response_changes(case, without):
    rows, known = rows_of(case), set(far_frequencies(Size(9, 9), case[2]))
    others = [k for k in representatives(far_frequencies(Size(15, 15), case[2])) if k not in known]
    before, after = (errors(case, one(case, rows), rows, others) for one in (without, estimated))
    np.testing.assert_allclose(after, before, atol=1e-5)
    assert len(others) > 50


@pytest.mark.parametrize(("channels", "offset"), [(1, 0.0), (3, 0.0), (1, 0.1)])
def test_noise_alone_is_left_alone(channels, offset, without):
    rows = rows_of(FINE, ring=0.0)
    options = {"channels": channels, "noise": 1e-2, "offset": offset}
    before, after = (one(FINE, rows, **options) for one in (without, estimated))
    added = (after.far - before.far)[..., 1:]
    # Averages of 25 camera pixels have a 25th of the variance, and most of that is not taken.
    assert np.mean(added**2) < 0.3 * 1e-4 / 25
    # What is added to a share of the responses is a matter of chance.
    assert (added != 0).any()


def test_camera_pixels_without_q_stay_as_they_are(without):
    rows, q = rows_of(FINE), places(FINE[3])
    dark = np.zeros(CAMERA, dtype=bool)
    dark[4:7, 5:9] = True
    q[dark] = np.nan
    # Their light is nothing like that of the rest.
    rows[dark.ravel()] = np.random.default_rng(2).uniform(0, 2e-2, (dark.sum(), rows.shape[1]))
    before, after = (one(FINE, rows, q=q) for one in (without, estimated))
    np.testing.assert_array_equal(after.far[dark], before.far[dark])


def test_others_residuals_say_nothing_of_camera_pixels_with_q():
    rows, q = rows_of(FINE), places(FINE[3])
    dark = np.zeros(CAMERA, dtype=bool)
    dark[4:7, 5:9] = True
    q[dark] = np.nan
    found = []
    for factor in (1.0, 7.0):
        seen = np.where(dark.ravel()[:, None], factor, 1.0) * rows
        problem = lay_out(measurements_of(FINE, seen, noise=1e-5), q, NearBasis(FINE[0], 1), "cpu")
        nothing = _empty_rows(problem)
        choice = nothing.choices.sweeps[0]
        nothing = nothing._replace(choices=nothing.choices._replace(of_error_bars=choice))
        rows_found, _ = with_remainder(problem, nothing)
        found.append(rows_found.far.reshape(*CAMERA, -1))
    assert not found[0][dark].any()
    assert found[0][~dark].any()
    np.testing.assert_array_equal(found[0][~dark], found[1][~dark])


def test_dark_camera_pixels_count_by_their_noise():
    rows = rows_of(FINE)
    dark = np.zeros(CAMERA, dtype=bool)
    dark[::2, ::2] = True
    rows[dark.ravel()] *= 1e-3 / rows[dark.ravel()].sum(axis=1, keepdims=True)
    found = estimated(FINE, rows)
    inner = np.zeros(CAMERA, dtype=bool)
    inner[3:-3, 3:-3] = True
    off = errors(FINE, found, rows, frequencies_of(FINE[2]))
    bright, faint = (np.mean(off[(inner & one).ravel()] ** 2) for one in (~dark, dark))
    assert faint < bright
    assert bright < NOISE**2


def test_some_rows_are_estimated_as_among_all():
    for case in (FINE, COARSE):
        rows, q = rows_of(case), places(case[3]).astype(np.float32)
        given = measurements_of(case, rows), q, case[0], FAR
        whole, some = (
            estimate_jointly(*given, pitch=case[1], rows=each) for each in (None, slice(5, 7))
        )
        np.testing.assert_allclose(some.far, whole.far[5:7], atol=2e-6)


@pytest.mark.parametrize("case", [FINE, COARSE])
def test_error_bars_leave_out_what_neighbours_explain(case, without):
    rows = rows_of(case)
    found, plain = estimated(case, rows), estimated(case, rows_of(case, ring=0.0))
    with_ring, alone = (np.mean(each.posterior.noise_share) for each in (found, plain))
    assert with_ring < 0.9 < alone
    assert np.all(without(case, rows).posterior.noise_share == 1.0)
    assert found.posterior.noise_share.min() >= 0.5


def test_photo_units_change_nothing():
    rows = rows_of(FINE)
    one = estimated(FINE, rows)
    for scale in (1e-12, 1e6):
        other = estimated(FINE, scale * rows, noise=scale * NOISE)
        np.testing.assert_allclose(other.far / scale, one.far, atol=2e-5)
        shares = one.posterior.noise_share
        np.testing.assert_allclose(other.posterior.noise_share, shares, atol=1e-3)


@pytest.mark.parametrize("case", [FINE, COARSE])
def test_sweeps_alone_add_nothing(case, without):
    rows, (window, pitch, _, step) = rows_of(case), case
    given = measurements_of(case, rows), places(step).astype(np.float32), window, FAR
    found = estimate_by_sweeps(*given, pitch=pitch)
    np.testing.assert_array_equal(found.far, without(case, rows).far)
    assert np.all(found.posterior.noise_share == 1.0)
