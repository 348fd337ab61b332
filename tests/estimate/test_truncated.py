"""Error bars by where a row has light: what no photo shows lies about its bright entries."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.error_bars import ErrorBars
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.joint.error_bars import JointVariances
from nearfar.estimate.truncated import (
    FADING,
    LEAST_LEFT,
    WEIGHT_OF_OUTLINES,
    Rows,
    change_by_place,
    share_missed,
    truncated_variance,
)
from nearfar.illumination.frequencies import far_frequencies, representatives
from nearfar.illumination.pictures import random_pattern
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measure import measure
from nearfar.plan import choose_plan
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import spectral_density
from nearfar.priors.fitted import LIGHT_WITH_EDGES
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.hostile import hostile_transport
from nearfar.transport.model import Transport
from nearfar.workflow.acquire import acquire_in_memory

PROJECTOR = Size(12, 14)
# That of transports that are reconstructed.
SQUARE = Size(14, 14)
# Light of which nothing is known, and light that falls with frequency, though less than rows that
# may have outlines.
COMPONENTS = (PriorComponent(0.0, 1.0, 1e6), PriorComponent(0.0, 1.0, FADING + 1.0))


def _transport(rows):
    """Hold the low frequencies of rows (n, channels, Py, Px) as far-range light."""
    basis = real_basis(representatives(far_frequencies(Size(5, 5), PROJECTOR)), PROJECTOR)
    count, channels = rows.shape[:2]
    shape = (1, count, channels)
    return Transport(
        projector=PROJECTOR,
        correspondence=np.full((1, count, 2), np.nan, np.float32),
        direct=np.zeros(shape, np.float32),
        near=np.zeros((*shape, 3, 3), np.float32),
        far=basis.analyse(rows.reshape(*shape, -1).astype(np.float32)) / basis.weights,
        far_basis=basis,
        black=np.zeros(shape, np.float32),
        noise=np.full(shape, 1e-3, np.float32),
    )


def _multiplicity(transport, often=1.0):
    """Return how often each frequency was measured: those that the transport holds, alike."""
    found = np.zeros(transport.projector)
    cycles = transport.far_basis.cycles * transport.projector
    for sign in (1, -1):
        y, x = (np.rint(sign * cycles).astype(int) % transport.projector).T
        found[y, x] = often
    return found


def _changes(transport, light, component, scale=1.0, noise=0.0):
    shape = (transport.camera.pixels, transport.channels)
    rows = Rows(
        np.full(shape[0], component),
        np.full(shape, float(scale) ** 2),
        np.full(shape, float(noise) ** 2),
        _multiplicity(transport),
    )
    return change_by_place(transport, light.ravel(), COMPONENTS, rows)(slice(None))


def _single(y, x):
    light = np.zeros(PROJECTOR)
    light[y, x] = 1.0
    return light


def _bump(height=1.0, base=0.0):
    y, x = (np.arange(side) - side // 2 for side in PROJECTOR)
    return base + height * np.exp(-(y[:, None] ** 2 + x**2) / 8.0)


def test_rows_that_are_dark_or_even_change_nothing():
    transport = _transport(np.stack([np.zeros(PROJECTOR), np.ones(PROJECTOR)])[:, None])
    for component in range(2):
        total = truncated_variance(transport, _single(3, 4).ravel(), COMPONENTS)[component]
        changes = _changes(transport, _single(3, 4), component)
        np.testing.assert_allclose(changes, 0.0, atol=1e-5 * total)


def test_white_and_what_the_transport_holds_change_nothing():
    transport = _transport(_bump()[None, None])
    y = np.arange(PROJECTOR.height)[:, None]
    held = 0.5 + 0.5 * np.cos(2 * np.pi * y / PROJECTOR.height) * np.ones(PROJECTOR)
    for light in (np.ones(PROJECTOR), held):
        assert np.all(_changes(transport, light, 0) == 0.0)


def test_bars_are_wide_at_bright_entries_and_narrow_at_dark_ones():
    transport = _transport(_bump()[None, None])
    scale = 0.01
    bright = _changes(transport, _single(6, 7), 0, scale).item()
    dark = _changes(transport, _single(0, 0), 0, scale).item()
    total = scale**2 * truncated_variance(transport, _single(0, 0).ravel(), COMPONENTS)[0]
    assert dark < -0.8 * total
    assert bright > total
    # A twentieth is the same everywhere.
    assert dark > -0.951 * total


@pytest.mark.parametrize("component", [0, 1])
def test_what_all_projector_pixels_add_up_to_stays_where_rows_are_not_sparse(component):
    # A bump on much light has little kurtosis, so that bars are standard deviations.
    transport = _transport(_bump(0.8, 1.0)[None, None])
    changes, total = [], 0.0
    for y in range(PROJECTOR.height):
        for x in range(PROJECTOR.width):
            changes.append(_changes(transport, _single(y, x), component).item())
            total += truncated_variance(transport, _single(y, x).ravel(), COMPONENTS)[component]
    assert np.max(np.abs(changes)) > 0.2 * total / len(changes)
    assert abs(sum(changes)) < 1e-4 * total


def test_bars_of_sparse_rows_are_narrower_the_less_is_known_of_them():
    transport = _transport(_bump()[None, None])
    every = [_single(y, x) for y in range(PROJECTOR.height) for x in range(PROJECTOR.width)]
    shares = []
    for scale in (1e-6, 0.1, 1e3):
        total = sum(truncated_variance(transport, one.ravel(), COMPONENTS)[0] for one in every)
        change = sum(_changes(transport, one, 0, scale).item() for one in every)
        shares.append(1 + change / (scale**2 * total))
    assert shares[0] > 0.99
    assert shares[0] > shares[1] > shares[2]
    # A quarter of a standard deviation where nothing is known.
    assert 0.25**2 <= shares[2] < 0.1


def test_bars_under_light_of_many_projector_pixels_are_standard_deviations():
    transport = _transport(_bump()[None, None])
    lights = np.random.default_rng(0).random((60, *PROJECTOR))
    total = sum(truncated_variance(transport, one.ravel(), COMPONENTS)[0] for one in lights)
    change = sum(_changes(transport, one, 0, 10.0).item() for one in lights) / 100.0
    assert abs(change) < 0.05 * total


def test_channels_and_camera_pixels_keep_their_own_scales():
    rows = np.stack([np.stack([_bump(), 0.5 * _bump()]), np.stack([_bump(), np.zeros(PROJECTOR)])])
    transport = _transport(rows)
    chosen, light = np.array([0, 1]), _single(6, 7).ravel()
    squared = np.array([[1.0, 4.0], [9.0, 0.0]])
    rows = Rows(chosen, squared, np.zeros((2, 2)), _multiplicity(transport))
    change = change_by_place(transport, light, COMPONENTS, rows)
    both = change(slice(None))
    for pixel in range(2):
        one = slice(pixel, pixel + 1)
        alone = change(one)
        np.testing.assert_allclose(both[one], alone, rtol=1e-5)
    np.testing.assert_allclose(both[0, 1], 4.0 * both[0, 0], rtol=1e-6)
    assert both[1, 1] == 0.0


def _missed(transport, light, density, ratio):
    """Return the variance of what an estimate misses, at unit prior scale."""
    power = np.abs(np.fft.fft2(light)) ** 2
    expected = np.full(transport.projector, density)
    expected[0, 0] = 0.0
    gain = 0.5 * expected * ratio * _multiplicity(transport)
    gain /= 1 + gain
    return np.sum(expected * (1 - gain) ** 2 * power) / transport.projector.pixels**2


@pytest.mark.parametrize("octave", [-6, 0, 3])
def test_what_noise_makes_the_prior_shrink_lies_about_bright_entries_too(octave):
    # Little of the bump is not known: bars are standard deviations.
    transport, scale = _transport(_bump()[None, None]), 1e-4
    noise = scale * 2.0 ** (-octave / 2)
    density = spectral_density(np.zeros(1), COMPONENTS[0]).item()
    missed = scale**2 * _missed(transport, _single(0, 0), density, 2.0**octave)
    changes = [
        _changes(transport, _single(y, x), 0, scale, noise).item()
        for y in range(PROJECTOR.height)
        for x in range(PROJECTOR.width)
    ]
    assert abs(sum(changes)) < 1e-3 * len(changes) * missed
    # All but five per cent of it is taken from dark entries.
    assert changes[0] == pytest.approx(-0.95 * missed, rel=0.01)
    # Without noise only what the transport does not hold is missed.
    assert changes[0] < _changes(transport, _single(0, 0), 0, scale).item()


def test_rows_of_larger_projectors_are_not_looked_at():
    transport = replace(_transport(_bump()[None, None]), pitch=2, near=np.zeros((1, 1, 1, 9, 1)))
    assert transport.pitch == 2
    assert np.all(_changes(transport, _single(6, 7), 0) == 0.0)


def _found(name, photos, projector=SQUARE, window=None):
    """Reconstruct a hostile transport; and its true rows."""
    scene = hostile_transport(name, projector, Size(14, 16))
    plan, _ = choose_plan(projector, photos, window=window)
    camera = SimulatedCamera(
        full_well=1e6, read_noise=1e3, bits=16, black_level=0.1, shot_noise=False
    )
    rig = SimulatedRig(scene, name, SimulatedProjector(), camera, 0.8, 0)
    measurements = measure(acquire_in_memory(plan, rig))
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    return found, 0.8 * scene.rows(slice(None))[:, 0]


def test_no_rounding_takes_all_of_a_bar(monkeypatch):
    found, _ = _found("caustics", 60)
    light = np.eye(found.projector.pixels, dtype=np.float32)[40].reshape(found.projector)
    squares = ErrorBars(found).mean_squares(light).ravel()
    # With little else than truncated light, rounding can take more than there is.
    monkeypatch.setattr(
        JointVariances,
        "change_by_place",
        lambda self, light, gains: lambda batch: -1.01 * squares[batch, None],
    )
    bars = ErrorBars(found).picture(light).ravel()
    np.testing.assert_allclose(bars**2, LEAST_LEFT * squares, rtol=1e-4)
    assert np.all(bars > 0)


@pytest.mark.parametrize("name", ["caustics", "permuted"])
@pytest.mark.parametrize("photos", [60, 130])
def test_errors_of_single_projector_pixels_lie_within_their_bars(name, photos):
    found, truth = _found(name, photos)
    bars, projector = ErrorBars(found), found.projector
    rows = found.rows(slice(None))[:, 0]
    within, within_mean, errors, expected = [], [], [], []
    for pixel in range(0, projector.pixels, 5):
        light = np.eye(projector.pixels, dtype=np.float32)[pixel].reshape(projector)
        error = np.abs(rows[:, pixel] - truth[:, pixel])
        within.append(error < bars.picture(light).ravel())
        within_mean.append(error**2 < bars.mean_squares(light).ravel())
        errors.append(error)
        expected.append(bars.picture(light).ravel())
    assert 0.6 < np.mean(within) < 0.78
    # One and the same bar for all entries of a row would hold more of them.
    assert np.mean(within_mean) > np.mean(within) + 0.05
    # Bars tell where errors are large.
    largest = np.argsort(np.ravel(expected))[-len(np.ravel(expected)) // 10 :]
    assert np.mean(np.ravel(errors)[largest]) > 2.5 * np.mean(errors)


@pytest.mark.parametrize("component", [0, 1])
def test_the_share_that_is_missed_is_of_what_was_not_measured_and_of_what_noise_shrinks(component):
    transport = _transport(np.zeros((2, 1, *PROJECTOR)))
    held = _multiplicity(transport)
    down, across = (side * np.fft.fftfreq(side) for side in PROJECTOR)
    density = spectral_density(np.hypot(down[:, None], across), COMPONENTS[component])
    density[0, 0] = 0.0

    def missed(noise, often):
        scale = np.array([[0.3], [0.3]])
        variance = np.full((2, 1), noise**2)
        rows = Rows(np.full(2, component), scale**2, variance, often)
        (one, other) = share_missed(transport, COMPONENTS, rows)
        assert one == other
        return one

    assert missed(0.0, held) == pytest.approx(density[held == 0].sum() / density.sum())
    assert missed(0.0, np.ones(PROJECTOR)) == pytest.approx(0.0, abs=1e-12)
    assert missed(1e9, np.ones(PROJECTOR)) == pytest.approx(1.0)
    assert missed(0.1, held) < missed(0.2, held) < missed(0.4, held)


def test_where_photos_leave_no_room_for_a_third_place_error_bars_are_no_wider():
    """Glass, every frequency of which is measured: one standard deviation holds 68 %."""
    projector, camera = Size(16, 16), Size(20, 20)
    scene = hostile_transport("glass", projector, camera)
    plan, _ = choose_plan(projector, 307, checks=0)
    rig = SimulatedRig(
        scene,
        "glass",
        SimulatedProjector(),
        SimulatedCamera(full_well=1e6, read_noise=500, bits=16, black_level=0.12, shot_noise=False),
        0.8,
        0,
    )
    measurements = measure(acquire_in_memory(plan, rig))
    q = correspond_by_phase(measurements, pitch=plan.pitch).q
    found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
    assert found.second_place is not None
    bars, within = ErrorBars(found), []
    for light in np.random.default_rng(5).random((8, *projector)):
        error = (found @ light).ravel() - 0.8 * (scene @ light).ravel()
        within.append(np.abs(error) < bars.picture(light).ravel())
    assert 0.63 < np.mean(within) < 0.72


def test_rows_that_fade_may_have_outlines_where_no_photo_shows_it():
    """The variance of waves, of light that fades and of light with edges of the same power."""
    transport = _transport(np.zeros((1, 1, *PROJECTOR)))
    is_held = _multiplicity(transport) > 0
    is_held[0, 0] = False
    down, across = (side * np.fft.fftfreq(side) for side in PROJECTOR)
    radius = np.hypot(down[:, None], across)
    edges = spectral_density(radius, LIGHT_WITH_EDGES)
    kinds = [PriorComponent(0.0, 7.0, decay) for decay in (0.7, FADING, FADING + 0.1)]
    kinds.append(PriorComponent(2.0, 7.0, 0.7))
    for place in ((0, 5), (6, 1)):
        wave = np.zeros(PROJECTOR, dtype=complex)
        wave[place] = PROJECTOR.pixels
        light = np.fft.ifft2(wave).real.ravel()
        power = (np.abs(np.fft.fft2(light.reshape(PROJECTOR))) ** 2).sum() / PROJECTOR.pixels**2
        variance = truncated_variance(transport, light, kinds) / power
        for one, kind in zip(variance, kinds, strict=True):
            own = spectral_density(radius, kind)
            expected = own[place]
            if kind.near_reach == 0.0 and kind.far_decay <= FADING:
                alike = np.mean(own[is_held] / edges[is_held])
                expected += WEIGHT_OF_OUTLINES * (alike * edges[place] - expected)
            assert one == pytest.approx(expected, rel=1e-6)


def test_pictures_of_smooth_rows_with_an_outline_lie_within_their_bars():
    """Lamps of a size that the weight of outlines was not fitted to."""
    found, truth = _found("lamps", 86, Size(18, 12), window=1)
    bars, within = ErrorBars(found), []
    for seed in range(40):
        light = random_pattern(found.projector, seed)
        error = (found @ light).ravel() - truth @ light.ravel()
        within.append(np.abs(error) < bars.picture(light).ravel())
    # Without outlines half of them do.
    assert 0.6 < np.mean(within) < 0.76
