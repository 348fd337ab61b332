"""Functions of several projector pixels: the posterior mean, cut by the border and whole."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.estimate.joint.batch import AllPixels, gather, offset_noise, white_scale
from nearfar.estimate.joint.cut import (
    border_distances,
    cut_responses,
    is_cut,
    near_responses,
)
from nearfar.estimate.joint.footprint import footprint_boxes, footprint_weights
from nearfar.estimate.joint.nuisance import amplitude_responses, prior_precision
from nearfar.estimate.joint.shares import share_on_projector
from nearfar.estimate.joint.solve import variance_ratio
from nearfar.estimate.joint.solve_hats import leading_count, solve_hats
from nearfar.illumination.centred_basis import centred_basis
from nearfar.illumination.frequencies import DC, far_frequencies, representatives, wrap
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.photometry.measurements import Measurements
from nearfar.priors.component import PriorComponent
from nearfar.priors.covariance import covariance_of_coefficients, far_variance
from nearfar.priors.responses import response_prior
from nearfar.transport.boxes import box_overlaps
from nearfar.transport.seen import box_centres, seen_of_projector

PROJECTOR = Size(70, 90)
BASIS = NearBasis(5, 4)
COMPONENT = PriorComponent(1.5, 8.0, 2.0, roughness=0.2)
FREQUENCIES = [k for k in representatives(far_frequencies(Size(11, 11), PROJECTOR)) if k != DC]
NOISE, WHITE = 1e-3, 0.5


def _centred():
    centred = centred_basis(real_basis(FREQUENCIES, PROJECTOR), BASIS)
    return replace(centred, response_indices=np.arange(1, centred.basis.count + 1))


def _measured(centres, *, channels=2):
    """Measure light that is nothing but noise: the posterior mean is linear."""
    basis = real_basis([DC, *FREQUENCIES], PROJECTOR)
    draw = np.random.default_rng(4)
    shape = (len(centres), channels)
    responses = draw.normal(size=(*shape, basis.count)).astype(np.float32)
    responses[..., 0] = WHITE
    level = np.full(shape, NOISE, dtype=np.float32)
    return Measurements(
        camera=Size(1, len(centres)),
        basis=basis,
        responses=responses,
        noise=level,
        black=np.zeros_like(level),
        quantisation_error=np.empty((basis.count, 0), dtype=np.float32),
        white_noise=level,
        black_noise=level,
    )


def _batch(centres, centred):
    measurements = _measured(centres)
    pixels = AllPixels(
        responses=measurements.responses[..., centred.response_indices],
        correspondence=centres + np.array([0.25, 0.0]),
        centres=centres,
        lit=np.ones(len(centres), dtype=bool),
        noise=measurements.noise,
        offset_noise=offset_noise(measurements),
        white=white_scale(measurements),
        spike_expected=np.zeros((len(centres), 0), dtype=bool),
        footprint=np.tile(np.float32([1.4, 1.4, 0.3, -0.2]), (len(centres), 1)),
        is_even=np.ones(len(centres), dtype=bool),
    )
    return gather(pixels, slice(None), centred, PROJECTOR)


def _by_hand(centred, centre):
    """Responses of the functions to patterns drawn about q, summed over the projector alone."""
    places = np.stack(np.meshgrid(*map(np.arange, PROJECTOR), indexing="ij"), axis=-1)
    offsets = places.reshape(-1, 2) - centre
    patterns = centred.basis.patterns_at(offsets).astype(np.float64)
    return patterns @ BASIS.values_at(offsets)


# Even distances from the border, to which distances are rounded at a pitch of four.
CORNERS = np.array([[0, 0], [69, 2], [4, 40], [35, 87], [8, 81], [35, 45], [0, 89]])
WHOLE = np.array([[35, 45], [33, 40]])


def test_a_cut_function_answers_by_what_is_left_of_it():
    centred = _centred()
    for centre in CORNERS:
        (distances,) = border_distances(centre[None], BASIS, PROJECTOR).tolist()
        found = cut_responses(centred, tuple(distances))
        np.testing.assert_allclose(found, _by_hand(centred, centre), atol=1e-5)
    shares = share_on_projector(CORNERS, BASIS.offsets, BASIS.pitches, PROJECTOR)
    white = centred_basis(real_basis([DC], PROJECTOR), BASIS)
    by_hand = np.stack([_by_hand(white, centre)[0] for centre in CORNERS])
    np.testing.assert_allclose(shares, by_hand, atol=1e-6)
    coefficients = np.random.default_rng(1).normal(size=(len(CORNERS), 2, BASIS.count))
    expected = [c @ _by_hand(centred, at).T for c, at in zip(coefficients, CORNERS, strict=True)]
    np.testing.assert_allclose(near_responses(coefficients, CORNERS, centred), expected, atol=1e-4)


def test_distances_are_rounded_by_a_fifth_at_most_and_never_past_the_reach():
    centres = np.stack([np.arange(70), np.full(70, 45)], axis=1)
    above, below, left, right = border_distances(centres, BASIS, PROJECTOR).T
    exact = np.minimum(np.arange(70), BASIS.reach)
    assert np.all(np.abs(above - exact) <= 0.2 * exact)
    assert np.array_equal(below, above[::-1])
    assert np.all(left == BASIS.reach)
    assert np.all(right == BASIS.reach)
    # What counts as whole is not cut at all, or only at the very end.
    whole = ~is_cut(centres, BASIS, PROJECTOR)
    assert np.array_equal(whole, np.minimum(above, below) == BASIS.reach)
    assert whole[exact == BASIS.reach][:20].all()


def _dense_gain(centred, batch, c, i, component, scale, multiplicity):
    """From responses to the means of amplitudes, functions and f, by dense algebra."""
    amplitudes = amplitude_responses(batch, centred).astype(np.float64)
    precision = prior_precision(batch, BASIS)
    squared = (scale * WHITE) ** 2
    count, each = amplitudes.shape[1], BASIS.count
    responses = np.concatenate(
        [amplitudes[c].T, _by_hand(centred, batch.centres[c]), np.eye(centred.basis.count)], axis=1
    )
    before = np.zeros((responses.shape[1],) * 2)
    before[:count, :count] = np.diag(1 / precision[c, i])
    near = slice(count, count + each)
    before[near, near] = squared * covariance_of_coefficients(component, BASIS, PROJECTOR)
    before[count + each :, count + each :] = squared * np.diag(
        far_variance(centred.basis, component)
    )
    noise = np.diag(NOISE**2 / multiplicity.astype(float))
    seen = responses @ before @ responses.T + noise
    return before @ responses.T @ np.linalg.inv(seen), near


def test_the_mean_is_that_of_dense_algebra():
    centred = _centred()
    batch = _batch(WHOLE, centred)
    multiplicity = np.linspace(1.0, 2.0, centred.basis.count).astype(np.float32)
    prior = response_prior(COMPONENT, centred, multiplicity)
    scale = 2.0**-5 * NOISE / WHITE * 2**8
    ratio = variance_ratio(batch, np.full(len(WHOLE), scale))
    every = batch._replace(responses=batch.responses.copy())
    units = amplitude_responses(batch, centred)
    found = solve_hats(every, units, prior, ratio, centred.basis.count, BASIS)
    for c, i in np.ndindex(len(WHOLE), 2):
        gain, near = _dense_gain(centred, batch, c, i, COMPONENT, scale, multiplicity)
        mean = gain @ batch.responses[c, i]
        size = np.abs(mean[near]).max()
        np.testing.assert_allclose(found.near[c, i], mean[near], rtol=0, atol=2e-3 * size)
        far = mean[near.stop :]
        np.testing.assert_allclose(found.far[c, i], far, rtol=0, atol=2e-3 * np.abs(far).max())


def test_what_faint_eigenvectors_tell_is_far_below_what_is_not_known():
    centred = _centred()
    batch = _batch(WHOLE, centred)
    multiplicity = np.linspace(1.0, 2.0, centred.basis.count).astype(np.float32)
    prior = response_prior(COMPONENT, centred, multiplicity)
    scale = 0.1 * NOISE / WHITE
    ratio = variance_ratio(batch, np.full(len(WHOLE), scale))
    count = int(leading_count(prior, ratio.max()))
    assert count < 0.7 * centred.basis.count
    noisy = batch._replace(responses=NOISE * batch.responses)
    every = noisy._replace(responses=noisy.responses.copy())
    found = solve_hats(every, amplitude_responses(batch, centred), prior, ratio, count, BASIS)
    for c, i in np.ndindex(len(WHOLE), 2):
        gain, near = _dense_gain(centred, batch, c, i, COMPONENT, scale, multiplicity)
        mean = gain @ noisy.responses[c, i]
        variances = np.trace(prior.covariance), prior.far_variance.sum()
        for part, one, variance in (
            (near, found.near[c, i], variances[0]),
            (slice(near.stop, None), found.far[c, i], variances[1]),
        ):
            before = scale * WHITE * np.sqrt(variance)
            assert np.linalg.norm(one - mean[part]) < 0.05 * before


@pytest.mark.parametrize(
    "component", [PriorComponent(1.3, 1.0, 3.0), PriorComponent(6.0, 1.0, 3.0, roughness=1.0)]
)
@pytest.mark.parametrize("centre", [[69, 45], [66, 4], [0, 0]])
def test_each_sweep_finds_more_of_the_light_that_the_border_cuts(component, centre):
    centred = _centred()
    multiplicity = np.ones(centred.basis.count, dtype=np.float32)
    prior = response_prior(component, centred, multiplicity)
    draw, number, scale = np.random.default_rng(2), 200, 0.01
    size = scale * WHITE
    truth = size * draw.multivariate_normal(np.zeros(BASIS.count), prior.covariance, number)
    far = size * np.sqrt(prior.far_variance) * draw.normal(size=(number, centred.basis.count))
    noise = NOISE * draw.normal(size=far.shape)
    batch = _batch(np.tile(centre, (number, 1)), centred)
    direct = 0.3 * centred.of_direct(batch.direct_weights[:, 0])
    responses = truth @ _by_hand(centred, np.array(centre)).T + far + direct + noise
    responses = np.repeat(responses[:, None], 2, axis=1).astype(np.float32)
    places = np.stack(np.meshgrid(*map(np.arange, PROJECTOR), indexing="ij"), axis=-1)
    values = BASIS.values_at(places.reshape(-1, 2) - np.array(centre))
    near, found_far = np.zeros((number, 2, BASIS.count), np.float32), np.zeros_like(responses)
    errors = []
    # Later sweeps estimate small differences.
    for share in (1.0, 0.25, 0.25):
        ratio = variance_ratio(batch, np.full(number, share * scale))
        left = responses - near_responses(near, batch.centres, centred) - found_far
        count = int(leading_count(prior, ratio.max()))
        units = amplitude_responses(batch, centred)
        found = solve_hats(batch._replace(responses=left), units, prior, ratio, count, BASIS)
        near, found_far = near + found.near, found_far + found.far
        errors.append(np.sum((values @ (near[:, 0] - truth).T) ** 2))
    gain, at = _dense_gain(centred, batch, 0, 0, component, scale, multiplicity)
    exact = np.sum((values @ (responses[:, 0] @ gain[at].T - truth).T) ** 2)
    assert exact < 0.5 * np.sum((values @ truth.T) ** 2)
    assert errors[0] > errors[1] > errors[2]
    # The least that any estimate from these responses leaves is that of exact cuts.
    assert exact < errors[2] < 1.3 * exact


HIGH = [
    wrap(Fraction(y, 70), Fraction(x, 90))
    for y, x in ((9, 4), (2, 14), (12, -9), (17, 3), (5, 22), (20, -18), (26, 8), (3, 33))
]


def test_footprints_answer_by_the_pixels_that_they_cover():
    draw = np.random.default_rng(3)
    q = 20 + 30 * draw.random((6, 2))
    q[4] = np.nan
    footprints = np.array(
        [
            [0.0, 0.4, 0.0, 0.0],
            [1.0, 1.0, 0.3, -0.4],
            [1.6, 3.3, 0.0, 1.2],
            [7.5, 0.8, 3.1, 0.2],
            [1.0, 1.0, 1.0, 1.0],
            [2.0, 5.0, -2.0, 1.5],
        ]
    )
    centres = np.nan_to_num(np.rint(q), nan=0.0).astype(np.int64)
    centred = centred_basis(real_basis(HIGH, PROJECTOR), BASIS)
    found = footprint_weights(q, centres, footprints, centred)[:, 0]
    assert not found[4].any()
    # Boxes of many points, each of which lights the pixel that it is on.
    points = (np.arange(400) + 0.5) / 400 - 0.5
    for c in (0, 1, 2, 3, 5):
        places = []
        for skew in (footprints[c, 2:], -footprints[c, 2:]):
            sides = [
                np.rint(q[c, axis] + skew[axis] + footprints[c, axis] * points).astype(np.int64)
                for axis in (0, 1)
            ]
            places.append(np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 2))
        places = np.concatenate(places)
        offsets, counts = np.unique(places - centres[c], axis=0, return_counts=True)
        brute = centred.basis.patterns_at(offsets) @ (counts / counts.sum())
        np.testing.assert_allclose(found[c], brute, atol=0.01)


def test_a_camera_pixel_sees_as_much_as_q_moves_to_the_next():
    y, x = np.meshgrid(np.arange(12.0), np.arange(15.0), indexing="ij")
    q = np.stack([5 + 1.5 * y + 0.4 * x, 9 + 2.0 * x], axis=-1)
    # Another surface, and a shadow.
    q[:, 8:] += 30.0
    q[3:5, 2:4] = np.nan
    seen = seen_of_projector(q).reshape(12, 15, 4)
    lit = np.isfinite(q[..., 0])
    # The sides are (1.5, 0) and (0.4, 2); the boxes halve the slanted one.
    half = [np.hypot(1.5, 0.2), 1.0, 0.1, 0.5]
    np.testing.assert_allclose(seen[lit], half * np.ones((lit.sum(), 4)), rtol=1e-5)


def test_both_boxes_have_the_spread_of_the_parallelogram():
    draw = np.random.default_rng(11)
    for _ in range(5):
        sides = draw.normal(size=(2, 2)) * 3
        y, x = np.meshgrid(np.arange(6.0), np.arange(7.0), indexing="ij")
        q = 100 + y[..., None] * sides[0] + x[..., None] * sides[1]
        height, width, down, across = seen_of_projector(q)[20].astype(np.float64)
        points = (draw.random((100_000, 2)) - 0.5) @ sides
        variance = np.array([height, width]) ** 2 / 12 + np.array([down, across]) ** 2
        np.testing.assert_allclose(variance, points.var(axis=0), rtol=0.03)
        # The halved side's slant, of which halves show three quarters.
        halved = max((np.prod(side) for side in sides), key=abs) / 12
        assert down * across == pytest.approx(0.75 * halved)


@pytest.mark.parametrize("moves", [(0.6, 0.8), (1.0, 1.0), (1.6, 2.3), (5.2, 0.9)])
def test_the_middle_of_a_box_follows_from_its_centroid_on_whole_pixels(moves):
    y, x = np.meshgrid(np.arange(11.0), np.arange(9.0), indexing="ij")
    middles = np.stack([3.2 + moves[0] * y, 6.1 + moves[1] * x], axis=-1)
    rounded = np.rint(middles)
    pixels = np.arange(-6, 7)
    centroids = np.stack(
        [
            rounded[..., axis]
            + (
                box_overlaps((middles - rounded)[..., axis].ravel(), np.full(99, moves[axis]), 6)
                @ pixels
            ).reshape(11, 9)
            for axis in (0, 1)
        ],
        axis=-1,
    )
    centroids[4, 4] = np.nan
    found = box_centres(centroids, seen_of_projector(centroids))
    assert np.isnan(found[4, 4]).all()
    # Boxes are of the mean move nearby; within one pixel every middle has the same centroid.
    off = np.abs(found - middles)[np.isfinite(centroids)]
    assert np.median(off) < 0.02
    assert off.max() <= max(0.5 * (1.0 - min(moves)), 0.0) + 0.12
    before = np.abs(centroids - middles)[np.isfinite(centroids)]
    assert off.mean() <= before.mean()


@pytest.mark.parametrize("moves", [(0.4, 0.37), (0.25, 0.6)])
def test_what_fine_camera_pixels_see_is_told_though_their_centroids_go_in_stairs(moves):
    """Camera pixels of three by three rays, each of which ends on one projector pixel."""
    y, x = np.meshgrid(np.arange(60.0), np.arange(56.0), indexing="ij")
    middles = np.stack([3.2 + moves[0] * y, 6.1 + moves[1] * x], axis=-1)
    centroids = np.mean([np.rint(middles + ray * np.array(moves)) for ray in (-1 / 3, 0, 1 / 3)], 0)
    centroids += 0.02 * np.random.default_rng(0).standard_normal(middles.shape)
    seen = seen_of_projector(centroids).reshape(60, 56, 4)[5:-5, 5:-5, :2]
    # Moves to the next camera pixel come to 0.1 to 0.5 of it.
    np.testing.assert_allclose(np.mean(seen, axis=(0, 1)), moves, rtol=0.2)


@pytest.mark.parametrize("blur", [0.0, 2.0, 4.0])
def test_the_highest_frequencies_show_the_blur_of_the_projector(blur):
    draw = np.random.default_rng(7)
    camera = Size(12, 13)
    y, x = np.meshgrid(np.arange(12.0), np.arange(13.0), indexing="ij")
    q = np.stack([20 + 1.3 * y, 30 + 1.7 * x], axis=-1)
    q[2, 3] = np.nan
    centres = np.nan_to_num(np.rint(q), nan=0.0).astype(np.int64).reshape(-1, 2)
    centred = centred_basis(real_basis(HIGH, PROJECTOR), BASIS)
    seen = seen_of_projector(q).astype(np.float64)
    boxes = np.concatenate([np.hypot(seen[:, :2], blur), seen[:, 2:]], axis=1)
    direct = 0.4 * footprint_weights(q.reshape(-1, 2), centres, boxes, centred)[:, :1]
    white = np.full((camera.pixels, 1, 1), 0.5)
    responses = np.concatenate(
        [white, centred.uncentre(direct, centres)], axis=-1, dtype=np.float32
    )
    responses += 0.003 * draw.normal(size=responses.shape).astype(np.float32)
    level = np.full((camera.pixels, 1), 0.003, dtype=np.float32)
    basis = real_basis([DC, *HIGH], PROJECTOR)
    measurements = Measurements(
        camera, basis, responses, level, level, np.empty((basis.count, 0), dtype=np.float32)
    )
    found = footprint_boxes(measurements, q, seen_of_projector(q), BASIS).reshape(*camera, 4)
    assert not found[2, 3].any()
    lit = np.isfinite(q[..., 0])
    np.testing.assert_allclose(found[lit], boxes.reshape(*camera, 4)[lit], rtol=0.02)
