"""Prior components: covariances, and their eigenbases for measured responses."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.illumination.centred_basis import centred_basis
from nearfar.illumination.frequencies import DC, far_frequencies, representatives
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.priors.covariance import far_variance, near_covariance, spectral_density
from nearfar.priors.fitted import LIT_COMPONENTS, UNLIT_COMPONENTS
from nearfar.priors.responses import response_prior

PROJECTOR, WINDOW = Size(12, 15), 5
EVERY = (*LIT_COMPONENTS, *UNLIT_COMPONENTS)


def _basis():
    frequencies = representatives(far_frequencies(Size(5, 6), PROJECTOR))
    return real_basis([k for k in frequencies if k != DC], PROJECTOR)


@pytest.mark.parametrize("component", EVERY)
def test_covariances_are_positive_semidefinite(component):
    covariance = near_covariance(component, WINDOW, PROJECTOR)
    np.testing.assert_allclose(covariance, covariance.T)
    eigenvalues = np.linalg.eigvalsh(covariance)
    assert eigenvalues[0] >= -1e-9 * max(eigenvalues[-1], 1.0)
    assert (far_variance(_basis(), component) > 0).all()


def test_near_range_light_at_q_has_the_prior_scale_and_falls_off():
    smooth = next(one for one in LIT_COMPONENTS if not (one.direct_spread or one.roughness))
    variance = np.diag(near_covariance(smooth, WINDOW, PROJECTOR)).reshape(WINDOW, WINDOW)
    middle = WINDOW // 2
    assert variance[middle, middle] == pytest.approx(1.0)
    away = variance[middle, middle + 2]
    assert away == pytest.approx(np.exp(-2 * 2 / smooth.near_reach))


def test_a_row_has_near_range_light_on_that_row_alone():
    component = LIT_COMPONENTS[0]
    on_row = near_covariance(component, WINDOW, Size(1, 15))
    everywhere = near_covariance(component, WINDOW, PROJECTOR)
    middle = np.arange(WINDOW) + WINDOW * (WINDOW // 2)
    within = np.ix_(middle, middle)
    np.testing.assert_array_equal(on_row[within], everywhere[within])
    assert np.count_nonzero(on_row) == np.count_nonzero(on_row[within])


def test_a_cosine_and_its_sine_share_the_spectral_density():
    basis, component = _basis(), LIT_COMPONENTS[0]
    variance = far_variance(basis, component)
    cycles = np.linalg.norm(basis.cycles * np.array(PROJECTOR), axis=1)
    summed = np.bincount(basis.index, variance)
    np.testing.assert_allclose(summed, spectral_density(cycles, component))


@pytest.mark.parametrize("component", [LIT_COMPONENTS[2], LIT_COMPONENTS[10], UNLIT_COMPONENTS[1]])
def test_eigenvectors_make_the_responses_independent(component):
    basis = _basis()
    centred = centred_basis(basis, NearBasis(WINDOW))
    multiplicity = np.random.default_rng(0).integers(1, 5, basis.count).astype(np.float32)
    prior = response_prior(component, centred, multiplicity)
    patterns = centred.on_window.astype(np.float64)
    signal = patterns @ near_covariance(component, WINDOW, PROJECTOR) @ patterns.T
    signal += np.diag(far_variance(basis, component))
    across = prior.eigenvectors.astype(np.float64)
    largest = float(prior.eigenvalues[0])
    found = across.T @ signal @ across
    np.testing.assert_allclose(found, np.diag(prior.eigenvalues), atol=1e-5 * largest)
    # Noise of a mean of m measurements is 1 / m, and stays white.
    noise = across.T @ np.diag(1.0 / multiplicity) @ across
    np.testing.assert_allclose(noise, np.eye(basis.count), atol=1e-5)
    # The eigenbasis of all of the responses is the prior's own.
    again = prior.of_responses(np.arange(basis.count), centred, multiplicity)
    np.testing.assert_allclose(again.eigenvalues, prior.eigenvalues, atol=1e-5 * largest)


def test_light_with_edges_falls_as_the_spectrum_of_a_disc_does():
    (edged,) = (one for one in UNLIT_COMPONENTS if one.far_power)
    side = 256
    y, x = np.indices((side, side)) - side / 2
    cycles = np.hypot(*np.meshgrid(*2 * [np.fft.fftfreq(side) * side], indexing="ij"))
    power = np.zeros((side, side))
    # Discs of many radii, so that none of their rings stands out.
    for radius in np.linspace(60, 90, 31):
        power += np.abs(np.fft.fft2(np.hypot(y, x) < radius)) ** 2
    rings = np.arange(4, 40)
    found = [power[np.abs(cycles - ring) < 0.5].mean() for ring in rings]
    expected = spectral_density(rings.astype(float), edged)
    slope, expected_slope = (
        np.polyfit(np.log(1 + rings), np.log(p), 1)[0] for p in (found, expected)
    )
    assert expected_slope == pytest.approx(slope, rel=0.15)
