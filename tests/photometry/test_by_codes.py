"""Photos of all codes: the responses to all frequencies, with half the variance of sinusoids."""

from fractions import Fraction

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.illumination.frequencies import DC, Frequency
from nearfar.illumination.real_basis import basis_of_every_frequency
from nearfar.photometry.by_codes import (
    find_codes,
    responses_of_photos,
    weighing_of,
)
from nearfar.photometry.drift_removal import remove_drift
from nearfar.photometry.in_memory import PhotosInMemory
from nearfar.photometry.measure import measure, measured_basis, measured_frequencies
from nearfar.plan import choose_plan, paper_plan
from nearfar.plan.candidates import lowest_first
from nearfar.plan.codes import code, order_of_codes
from nearfar.plan.paper import sinusoids
from nearfar.plan.patterns import LampCode
from nearfar.plan.references import with_references

PROJECTOR, CAMERA = Size(8, 9), Size(6, 7)
NOISE = 0.002
# Rounds of all codes, and photos of waves.
KINDS = ((1, 0), (2, 0), (1, 16))


def code_plan(projector, rounds=1, waves=0):
    """Return a plan of all codes, each shown so many times, and of so many photos of waves."""
    order, references = order_of_codes(projector.pixels), 6
    shown = [code(number, order) for number in range(rounds * order)]
    lowest = lowest_first(projector)[: waves // 4]
    for inverse in (False, True):
        pairs = sinusoids(lowest, "far")
        shown += [p.model_copy(update={"inverse": inverse}) for p in pairs]
    plan, _ = choose_plan(projector, 24 + projector.pixels // 4, checks=0)
    return plan.model_copy(update={"patterns": with_references(shown, references, references)})


def taken(plan, transport, noise=0.0, black=0.1, seed=0):
    """Return photos of any transport, (Cy, Cx, channels, P), without rounding."""
    random = np.random.default_rng(seed)
    lights = np.stack([plan.draw(number).ravel() / 255 for number in range(len(plan.patterns))])
    photos = np.einsum("yxip,np->nyxi", transport, lights) + black
    photos += noise * random.standard_normal(photos.shape)
    return PhotosInMemory(plan, photos.astype(np.float32), 1.0)


def any_transport(projector=PROJECTOR, camera=CAMERA, channels=2, seed=1):
    """Return rows that are like nothing, of white about 0.5."""
    random = np.random.default_rng(seed)
    return random.random((*camera, channels, projector.pixels)) / projector.pixels


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("projector", [PROJECTOR, Size(1, 23), Size(30, 1), Size(12, 13)])
def test_codes_tell_the_response_to_every_frequency_of_any_transport(projector, kind):
    plan, transport = code_plan(projector, *kind), any_transport(projector)
    found = measure(taken(plan, transport))
    rows = transport.reshape(-1, 2, projector.pixels)
    np.testing.assert_allclose(found.responses, rows @ found.basis.patterns.T, atol=1e-5)
    np.testing.assert_allclose(found.black, 0.1, atol=1e-6)
    assert found.basis.count == projector.pixels
    assert set(found.basis.frequencies) == measured_frequencies(plan)
    basis, multiplicity = measured_basis(plan)
    assert basis == found.basis
    np.testing.assert_array_equal(multiplicity, found.multiplicity)


def test_the_responses_but_to_dc_are_the_least_squares_solution():
    plan = code_plan(PROJECTOR)
    photos = taken(plan, any_transport(), NOISE)
    found = measure(photos)
    numbers = sorted(find_codes(plan).rows)
    lights = np.stack([plan.draw(number).ravel() / 255 for number in numbers])
    read = remove_drift(photos).read(numbers, slice(None)).reshape(len(numbers), -1)
    solution = np.linalg.lstsq(
        np.concatenate([np.ones((len(numbers), 1)), lights], axis=1), read, rcond=None
    )[0][1:]
    expected = (found.basis.patterns @ solution).T.reshape(found.responses.shape)
    waves = np.delete(np.arange(found.basis.count), found.response_indices([DC]))
    np.testing.assert_allclose(found.responses[..., waves], expected[..., waves], atol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_errors_are_independent_and_as_large_as_is_said(kind):
    plan, transport = code_plan(PROJECTOR, *kind), any_transport(camera=Size(40, 50), channels=1)
    found = measure(taken(plan, transport, NOISE))
    rows = transport.reshape(-1, 1, PROJECTOR.pixels)
    errors = (found.responses - rows @ found.basis.patterns.T)[:, 0]
    said = found.noise / np.sqrt(found.multiplicity)
    dc = found.response_indices([DC])
    said[:, dc] = found.light_noise
    relative = errors / said
    # Of 2000 camera pixels, and the noise is estimated as well.
    np.testing.assert_allclose(relative.std(axis=0), 1.0, atol=0.12)
    correlation = np.corrcoef(np.delete(errors, dc, axis=1).T)
    assert np.abs(correlation - np.eye(len(correlation))).max() < 0.12


def test_codes_have_half_the_variance_of_sinusoids():
    # 83 codes for 80 projector pixels.
    projector = Size(8, 10)
    of_codes = code_plan(projector)
    sinusoids = paper_plan(projector, 3, Size(3, 3), offset="reference", correspondence="none")
    transport = any_transport(projector, Size(30, 40))
    rows = transport.reshape(-1, 2, projector.pixels)

    def variance(plan):
        found = measure(taken(plan, transport, NOISE))
        waves = [k for k in found.basis.frequencies if not k.is_own_negative]
        chosen = found.response_indices(waves)
        return np.var((found.responses - rows @ found.basis.patterns.T)[..., chosen])

    assert variance(of_codes) == pytest.approx(2 * 80 / 84 * NOISE**2, rel=0.05)
    # Twice a photo, and the errors of white and black as well.
    assert variance(sinusoids) > 4 * NOISE**2


def test_rows_of_the_camera_are_measured_as_the_whole_camera():
    without_drift = remove_drift(taken(code_plan(PROJECTOR), any_transport(), NOISE))
    whole, rows = measure(without_drift), measure(without_drift, slice(2, 5))
    first, last = 2 * CAMERA.width, 5 * CAMERA.width
    np.testing.assert_array_equal(rows.responses, whole.responses[first:last])
    np.testing.assert_array_equal(rows.noise, whole.noise[first:last])


# What waves answer to the rounding of other waves to levels is not in what a photo adds.
@pytest.mark.parametrize(("waves", "left_out"), [(0, 1e-5), (8, 1e-3)])
def test_what_photos_add_to_the_responses_is_as_if_they_were_others(waves, left_out):
    plan, transport = code_plan(PROJECTOR, waves=waves), any_transport()
    photos = taken(plan, transport)
    measuring = sorted(weighing_of(plan).place)
    numbers = [measuring[10], measuring[11], measuring[-1]]
    change = np.random.default_rng(2).random((3, CAMERA.pixels, 2)).astype(np.float32)
    others = photos.photos.copy()
    others[numbers] += change.reshape(3, *CAMERA, 2)
    without_drift = remove_drift(photos)
    changed = measure(remove_drift(PhotosInMemory(plan, others, photos.full_scale)))
    expected = measure(without_drift).responses + responses_of_photos(plan, numbers, change)
    others_than_dc = np.delete(np.arange(PROJECTOR.pixels), changed.response_indices([DC]))
    np.testing.assert_allclose(
        changed.responses[..., others_than_dc], expected[..., others_than_dc], atol=left_out
    )


def test_codes_that_are_missing_are_told():
    plan = code_plan(PROJECTOR)
    few = [p for i, p in enumerate(plan.patterns) if not (isinstance(p, LampCode) and i % 30 == 5)]
    part = plan.model_copy(update={"patterns": tuple(few)})
    with pytest.raises(InputError, match=r"of the photos of 79 codes are missing.*free rows"):
        measure(taken(part, any_transport()))
    with pytest.raises(InputError, match="are missing"):
        measured_frequencies(part)


def test_waves_that_are_none_of_the_projector_are_told():
    plan = code_plan(PROJECTOR)
    off_grid = tuple(sinusoids([Frequency(Fraction(1, 7), Fraction(0))], "near"))
    with pytest.raises(InputError, match=r"frequency \(1/7, 0\) beside codes"):
        measured_frequencies(plan.model_copy(update={"patterns": plan.patterns + off_grid}))


def test_rounding_of_waves_to_levels_leaves_no_error():
    """A wave of 8 bits that is shown often weighs as much as the codes, and is not quite a wave."""
    plan, transport = code_plan(PROJECTOR, waves=64), any_transport()
    spike = np.zeros_like(transport)
    spike[..., 37] = 0.5
    found = measure(taken(plan, spike))
    rows = spike.reshape(-1, 2, PROJECTOR.pixels)
    errors = found.responses - rows @ found.basis.patterns.T
    # An error of half a level of light 0.5 at one place, in two shares of three.
    assert np.abs(errors).max() < 1e-5


def test_all_frequencies_are_as_many_as_the_projectors_pixels():
    for size in (PROJECTOR, Size(1, 11), Size(16, 16)):
        assert basis_of_every_frequency(size).count == size.pixels
