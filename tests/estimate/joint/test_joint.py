"""The joint estimate against dense Gaussian algebra, and on worlds that obey the model."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.estimate.joint import estimate_jointly
from nearfar.estimate.joint.cut import solve_cut
from nearfar.estimate.joint.edges import seen_beside, with_spike
from nearfar.estimate.joint.evidence import best_kind, evidence, screened, tell
from nearfar.estimate.joint.neighbours import expect_each, expect_together
from nearfar.estimate.joint.nuisance import columns, precision
from nearfar.estimate.joint.pixels import Whole, gather, offset_noise, scale_of
from nearfar.estimate.joint.prior import build_prior
from nearfar.estimate.joint.solve import Found, ratio_of, solve_whole
from nearfar.estimate.matrices import Band, band_of
from nearfar.illumination.frequencies import DC
from nearfar.illumination.patterns import exponential
from nearfar.photometry.measurements import Measurements
from nearfar.plan.choose import choose_frequencies
from nearfar.transport import near
from nearfar.transport.far import real_basis
from nearfar.transport.kinds import LIT, STRENGTHS, Kind, far_power, near_covariance
from tests.worlds import model_transport

PROJECTOR = Size(16, 20)
WINDOW = 5
FAR = Size(5, 5)
KIND = Kind(1.5, 8.0, 2.0)


def _frequencies(photos=70):
    return list(choose_frequencies(PROJECTOR, photos, WINDOW).frequencies)


def _band(frequencies):
    basis = real_basis(frequencies, PROJECTOR)
    plain = band_of(basis, near.offsets(WINDOW))
    return Band(basis, np.arange(1, basis.count + 1), plain.on_window, plain.on_corners)


def _measure(rows, frequencies, *, noise=1e-4, seed=0, camera=None, channels=None, offset=0.0):
    """Measure dense rows (C, channels, P) with DC first; `offset` is the references' deviation."""
    generator = np.random.default_rng(seed)
    basis = real_basis([DC, *frequencies], PROJECTOR)
    count, channels = rows.shape[:2]
    answers = rows @ basis.patterns.T.astype(np.float64)
    answers = answers + noise * generator.normal(size=answers.shape)
    answers[..., 1:] += offset * generator.normal(size=(count, channels, 1))
    level = np.full((count, channels), noise, dtype=np.float32)
    return Measurements(
        camera=camera or Size(1, count),
        basis=basis,
        answers=answers.astype(np.float32),
        noise=level,
        black=np.zeros_like(level),
        shown_error=np.zeros((basis.count, PROJECTOR.pixels), dtype=np.float32),
        white_noise=np.full_like(level, offset),
    )


def _draw(count, centres, strength, seed=0):
    """Draw rows of KIND about chosen q, (C, 1, P), with direct light of 0.5, and their parts."""
    generator = np.random.default_rng(seed)
    covariance = near_covariance(KIND, WINDOW)
    windows = strength * generator.multivariate_normal(
        np.zeros(WINDOW**2), covariance, count, method="eigh"
    )
    rows = np.zeros((count, PROJECTOR.pixels))
    inside = near.inside(centres, WINDOW, PROJECTOR)
    places = near.places_on(centres, WINDOW, PROJECTOR)
    for c in range(count):
        np.add.at(rows[c], places[c], windows[c] * inside[c])
        rows[c, centres[c] @ [PROJECTOR.width, 1]] += 0.5
    return rows[:, None], windows * inside


def _pixels(measurements, centres, band):
    count = len(centres)
    whole = Whole(
        answers=measurements.answers[..., band.places],
        correspondence=centres.astype(float),
        centres=centres,
        lit=np.ones(count, dtype=bool),
        noise=measurements.noise,
        offset_noise=offset_noise(measurements),
        white=scale_of(measurements),
        likely=np.zeros((count, WINDOW**2), dtype=bool),
    )
    return gather(whole, slice(None), band, PROJECTOR)


def _solved(pixels, prior, strength, band, *, by=None):
    """Solve each camera pixel as its window asks, or all as told."""
    ratio = ratio_of(pixels, strength)
    if by is not None:
        return by(pixels, prior, ratio, band)
    inner = pixels.inside.all(axis=1)
    parts = [
        (np.flatnonzero(mine), solver(pixels.only(np.flatnonzero(mine)), prior, ratio[mine], band))
        for mine, solver in ((inner, solve_whole), (~inner, solve_cut))
        if mine.any()
    ]
    order = np.argsort(np.concatenate([number for number, _ in parts]))
    return Found(
        *(np.concatenate(values)[order] for values in zip(*(f for _, f in parts), strict=True))
    )


def _dense(measurements, pixels, band, strength, kind=KIND):
    """Posterior mean of (o, d, n, f) and the log evidence by plain linear algebra."""
    results = []
    window = near_covariance(kind, WINDOW)
    power = far_power(band.basis, kind)
    for c in range(len(pixels.white)):
        white, noise = float(pixels.white[c, 0]), float(pixels.noise[c, 0])
        cut = band.on_window * pixels.inside[c]
        s = (strength * white) ** 2
        shared = columns(pixels, band)[c].T.astype(np.float64)
        known = precision(pixels)[c, 0]
        covariance = (
            s * (cut @ window @ cut.T + np.diag(power))
            + shared @ np.diag(1 / known) @ shared.T
            + noise**2 * np.eye(len(power))
        )
        y = pixels.answers[c, 0].astype(np.float64)
        x = np.linalg.solve(covariance, y)
        _, logarithm = np.linalg.slogdet(covariance)
        near_mean = s * (window @ cut.T @ x) * pixels.inside[c]
        results.append((shared.T @ x / known, near_mean, s * power * x, -0.5 * (y @ x + logarithm)))
    return [np.stack(part) for part in zip(*results, strict=True)]


@pytest.mark.parametrize("offset", [0.0, 3e-3])
def test_the_mean_is_that_of_dense_algebra_inside_and_at_the_border(offset):
    # Far inside, at one border, at a corner.
    centres = np.array([[8, 10], [7, 9], [0, 10], [8, 18], [0, 0], [15, 19], [1, 18]])
    frequencies = _frequencies()
    band = _band(frequencies)
    rows, _ = _draw(len(centres), centres, 0.02)
    measurements = _measure(rows, frequencies, noise=2e-3, offset=offset)
    pixels = _pixels(measurements, centres, band)
    prior = build_prior(KIND, band, measurements.repeats[band.places])
    found = _solved(pixels, prior, np.full(len(centres), 0.05), band)
    shared, windows, far, _ = _dense(measurements, pixels, band, 0.05)
    scale, far_scale = np.abs(windows).max(), np.abs(far).max()
    np.testing.assert_allclose(found.near[:, 0], windows, atol=2e-3 * scale)
    np.testing.assert_allclose(found.far[:, 0], far, atol=2e-3 * far_scale)
    np.testing.assert_allclose(found.shared[:, 0, 1], shared[:, -1], atol=1e-4)
    if offset:
        np.testing.assert_allclose(found.shared[:, 0, 0], shared[:, 0], atol=1e-5)


def test_repeats_count_as_less_noise():
    centres = np.array([[8, 10], [7, 9]])
    frequencies = _frequencies()
    band = _band(frequencies)
    rows, _ = _draw(len(centres), centres, 0.02)
    measurements = _measure(rows, frequencies, noise=2e-3)
    nine = np.full_like(measurements.repeats, 9.0)
    means = [
        _solved(
            _pixels(m, centres, band),
            build_prior(KIND, band, m.repeats[band.places]),
            np.full(2, 0.05),
            band,
        )
        for m in (
            replace(measurements, repeats=nine),
            replace(measurements, noise=measurements.noise / 3),
        )
    ]
    np.testing.assert_allclose(means[0].near, means[1].near, atol=1e-5)
    np.testing.assert_allclose(means[0].shared, means[1].shared, atol=1e-5)


@pytest.mark.parametrize("offset", [0.0, 1e-3, 1e-2])
def test_the_evidence_is_that_of_dense_algebra(offset):
    centres = np.array([[8, 10], [7, 9], [6, 12]])
    frequencies = _frequencies()
    band = _band(frequencies)
    rows, _ = _draw(len(centres), centres, 0.02)
    measurements = _measure(rows, frequencies, noise=2e-3, offset=offset)
    pixels = _pixels(measurements, centres, band)
    prior = build_prior(KIND, band, measurements.repeats[band.places])
    found = evidence(tell(pixels), prior)
    expected = np.stack(
        [_dense(measurements, pixels, band, strength)[3] for strength in STRENGTHS], axis=1
    )
    # The table rounds (s / sigma)^2 to half a step, which the log evidence feels a little.
    difference = (found - found[:, :1]) - (expected - expected[:, :1])
    spread = expected.max(axis=1) - expected.min(axis=1)
    assert np.abs(difference).max(axis=1) == pytest.approx(0, abs=0.02 * spread.max() + 1.0)
    assert np.array_equal(found.argmax(axis=1), expected.argmax(axis=1))


def test_a_camera_pixel_chooses_the_kind_that_it_was_drawn_from():
    generator = np.random.default_rng(3)
    centres = np.stack([generator.integers(4, 12, 200), generator.integers(4, 16, 200)], axis=1)
    frequencies = _frequencies()
    band = _band(frequencies)
    rows, _ = _draw(len(centres), centres, 0.02)
    measurements = _measure(rows, frequencies, noise=1e-3)
    pixels = _pixels(measurements, centres, band)
    far_from = Kind(6.0, 256.0, 0.7)
    priors = [
        build_prior(kind, band, measurements.repeats[band.places]) for kind in (KIND, far_from)
    ]
    kind, strength, _ = best_kind(pixels, screened(priors, band, measurements.repeats[band.places]))
    assert np.mean(kind == 0) > 0.95
    # 0.02 in photo units, of a white that is 0.5 and a little.
    white = pixels.white[:, 0]
    assert np.median(strength * white) == pytest.approx(0.02, rel=0.5)


def test_few_answers_narrow_the_kinds_down_and_all_choose(monkeypatch):
    generator = np.random.default_rng(3)
    centres = np.stack([generator.integers(4, 12, 100), generator.integers(4, 16, 100)], axis=1)
    frequencies = _frequencies()
    band = _band(frequencies)
    repeats = np.ones(band.basis.count, dtype=np.float32)
    priors = tuple(build_prior(kind, band, repeats) for kind in LIT)
    unscreened = screened(priors, band, repeats)
    assert unscreened.screens is priors
    monkeypatch.setattr("nearfar.estimate.joint.evidence.ANSWERS", 24)
    narrowed = screened(priors, band, repeats)
    assert len(narrowed.chosen) == pytest.approx(24, abs=1)
    worse = []
    for strength in (0.003, 0.02, 0.1):
        rows, _ = _draw(len(centres), centres, strength)
        pixels = _pixels(_measure(rows, frequencies, noise=1e-3), centres, band)
        _, _, most = best_kind(pixels, unscreened)
        kind, _, found = best_kind(pixels, narrowed)
        # What is told of the kind that was chosen is told by all answers.
        values = np.stack([evidence(tell(pixels), prior).max(axis=1) for prior in priors])
        np.testing.assert_allclose(found, values[kind, np.arange(100)], rtol=1e-4, atol=1e-2)
        worse.append(most - found)
    # Odds of 20 against the kind that few answers left: hardly ever, of the 300.
    assert np.mean(np.concatenate(worse) > 3.0) < 0.03


@pytest.mark.parametrize("kind", [KIND, Kind(2.0, 8.0, 2.0, 3.0), Kind(2.0, 8.0, 2.0, rough=1.0)])
@pytest.mark.parametrize("uneven", [False, True])
def test_cut_windows_of_every_kind_are_those_of_dense_algebra(kind, uneven):
    centres = np.array([[0, 10], [8, 19], [1, 0], [8, 10], [15, 18], [0, 10]])
    frequencies = _frequencies()
    band = _band(frequencies)
    rows, _ = _draw(len(centres), centres, 0.02)
    measurements = _measure(rows, frequencies, noise=2e-3)
    repeats = measurements.repeats.copy()
    if uneven:
        # Cosines that were shown more often than their sines.
        repeats[band.places[~band.basis.is_sine]] = 4.0
    prior = build_prior(kind, band, repeats[band.places])
    pixels = _pixels(measurements, centres, band)
    found = _solved(pixels, prior, np.full(len(centres), 0.05), band, by=solve_cut)
    spread = np.diag(1.0 / repeats[band.places])
    window, power = near_covariance(kind, WINDOW), far_power(band.basis, kind)
    for c in range(len(centres)):
        cut = band.on_window * pixels.inside[c]
        squared = (0.05 * float(pixels.white[c, 0])) ** 2
        direct = columns(pixels, band)[c, 0].astype(np.float64)
        covariance = squared * (cut @ window @ cut.T + np.diag(power))
        covariance += float(pixels.noise[c, 0]) ** 2 * spread
        covariance += np.outer(direct, direct) / precision(pixels)[c, 0, 0]
        x = np.linalg.solve(covariance, pixels.answers[c, 0].astype(np.float64))
        for got, dense in (
            (found.near[c, 0], squared * (window @ cut.T @ x) * pixels.inside[c]),
            (found.far[c, 0], squared * power * x),
            (found.pull[c, 0], band.on_window.T @ x),
        ):
            np.testing.assert_allclose(got, dense, atol=1e-3 * np.abs(dense).max())


@pytest.mark.parametrize(
    ("projector", "window"),
    [(Size(1, 20), 1), (Size(1, 20), 5), (Size(20, 2), 4), (Size(16, 20), 2)],
)
def test_narrow_projectors_and_windows_are_reconstructed(projector, window):
    world = model_transport(projector, projector, window=3, far=Size(1, 1), entries=0)
    world = replace(world, near=np.zeros_like(world.near))
    frequencies = list(choose_frequencies(projector, 40, window).frequencies)
    basis = real_basis([DC, *frequencies], projector)
    rows = world.dense().astype(np.float64)
    answers = rows @ basis.patterns.T.astype(np.float64)
    noise = np.full(rows.shape[:2], 1e-4, dtype=np.float32)
    answers += 1e-4 * np.random.default_rng(0).normal(size=answers.shape)
    measurements = Measurements(
        camera=world.camera,
        basis=basis,
        answers=answers.astype(np.float32),
        noise=noise,
        black=np.zeros_like(noise),
        shown_error=np.zeros((basis.count, projector.pixels), dtype=np.float32),
    )
    found = estimate_jointly(measurements, world.correspondence, window, Size(1, 1))
    light = np.random.default_rng(1).random(projector)
    truth = world @ light
    assert np.linalg.norm(found @ light - truth) < 0.01 * np.linalg.norm(truth)


def test_whole_and_cut_agree_where_nothing_is_cut():
    centres = np.array([[8, 10], [7, 9], [6, 12]])
    frequencies = _frequencies()
    band = _band(frequencies)
    rows, _ = _draw(len(centres), centres, 0.02)
    measurements = _measure(rows, frequencies, noise=2e-3, offset=1e-3)
    prior = build_prior(KIND, band, measurements.repeats[band.places])
    pixels = with_spike(_pixels(measurements, centres, band), np.array([0, 3, 24]))
    one, other = (
        _solved(pixels, prior, np.full(3, 0.05), band, by=solver)
        for solver in (solve_whole, solve_cut)
    )
    for name in Found._fields:
        a, b = getattr(one, name), getattr(other, name)
        np.testing.assert_allclose(a, b, atol=2e-3 * np.abs(b).max(), err_msg=name)


def test_a_world_of_the_model_is_relit_by_few_answers():
    world = model_transport(
        PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), channels=2, entries=0, seed=2
    )
    world = replace(world, near=np.zeros_like(world.near))
    frequencies = _frequencies(60)
    measurements = _measure(
        world.dense().astype(np.float64), frequencies, noise=1e-5, camera=world.camera
    )
    found = estimate_jointly(measurements, world.correspondence, WINDOW, FAR)
    light = np.random.default_rng(0).random(PROJECTOR)
    truth = world @ light
    error = np.linalg.norm(found @ light - truth) / np.linalg.norm(truth)
    assert error < 3e-3
    assert np.abs(found.direct - world.direct).max() < 3e-3


def test_what_eight_bits_make_of_direct_light_is_no_other_light():
    world = model_transport(PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), seed=2)
    world = replace(world, near=0 * world.near, far=0 * world.far)
    frequencies = _frequencies(60)
    measurements = _measure(
        world.dense().astype(np.float64), frequencies, noise=1e-6, camera=world.camera
    )
    basis = measurements.basis
    drawn = np.rint(127.5 + 127.5 * basis.patterns.astype(np.float64)) / 127.5 - 1
    error = (drawn - basis.patterns).astype(np.float32)
    error[0] = 0
    misdrawn = replace(
        measurements,
        answers=(measurements.answers + world.direct.reshape(-1, 1, 1) * error.T[:, None]).astype(
            np.float32
        ),
    )

    def stray(told):
        found = estimate_jointly(told, world.correspondence, WINDOW, FAR)
        return np.sqrt(np.mean(found.near**2)) / world.direct.mean()

    unknown, known = stray(misdrawn), stray(replace(misdrawn, shown_error=error))
    assert known < 0.3 * unknown


def test_camera_pixels_without_direct_light_keep_far_light_alone():
    world = model_transport(PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), entries=0)
    q = world.correspondence.copy()
    q[3:6] = np.nan
    dark = replace(
        world,
        correspondence=q,
        direct=world.direct * np.isfinite(q[..., :1]),
        near=np.zeros_like(world.near),
    )
    measurements = _measure(
        dark.dense().astype(np.float64), _frequencies(), noise=1e-4, camera=world.camera
    )
    found = estimate_jointly(measurements, q, WINDOW, FAR)
    assert not found.direct[3:6].any()
    assert not found.near[3:6].any()
    for values in (found.direct, found.near, found.far):
        assert np.isfinite(values).all()
    light = np.random.default_rng(0).random(PROJECTOR)
    truth, relit = (dark @ light)[3:6], (found @ light)[3:6]
    assert np.linalg.norm(truth - relit) < 0.01 * np.linalg.norm(truth)


def test_direct_light_of_a_second_surface_is_found():
    centres = np.full((40, 2), (8, 10))
    rows, _ = _draw(len(centres), centres, 0.0)
    second = np.arange(len(centres)) < 20
    rows[second, 0, 6 * PROJECTOR.width + 12] += 0.2
    measurements = _measure(rows, _frequencies(140), noise=1e-3)
    q = centres.astype(np.float32)[None]
    found = estimate_jointly(measurements, q, WINDOW, FAR, turns=1)
    entry = found.near[0, :, 0, 0, 4]
    np.testing.assert_allclose(entry[second], 0.2, atol=0.01)
    assert np.abs(entry[~second]).max() < 0.01


def test_less_evidence_will_do_where_a_neighbour_sees_the_second_surface():
    # A row of camera pixels, the right ones on a surface that lies 4 pixels away.
    q = np.zeros((3, 10, 2))
    q[..., 0] = 8.0
    q[..., 1] = np.where(np.arange(10) < 5, 6.0, 10.0)
    likely = seen_beside(q, 9).reshape(3, 10, 9, 9)
    assert not likely[:, :4].any()
    assert not likely[:, 6:].any()
    around = np.zeros((9, 9), dtype=bool)
    around[3:6, 7:9] = True
    np.testing.assert_array_equal(likely[1, 4], around)
    np.testing.assert_array_equal(likely[1, 5], around[:, ::-1])
    # Too far for the window, or of camera pixels without direct light: nothing.
    q[:, 5:, 1] = 15.0
    assert not seen_beside(q, 9).any()
    q[:, 5:] = np.nan
    assert not seen_beside(q, 9).any()


def test_a_faint_second_surface_is_believed_beside_its_edge_alone():
    # Two surfaces 4 projector pixels apart; every camera pixel of the left one also sees the place
    # of the right one, too faintly to be believed by its own photos.
    camera, faint = Size(8, 10), 0.08
    q = np.full((*camera, 2), 8.0)
    q[..., 1] = np.where(np.arange(camera.width) < 5, 7.0, 11.0)
    rows = np.zeros((camera.pixels, 1, PROJECTOR.pixels))
    flat = (q[..., 0] * PROJECTOR.width + q[..., 1]).astype(int).ravel()
    rows[np.arange(camera.pixels), 0, flat] = 0.5
    left = (q[..., 1] == 7.0).ravel()
    rows[left, 0, 8 * PROJECTOR.width + 11] = faint
    measurements = _measure(rows, _frequencies(140), noise=0.06, camera=camera)
    found = estimate_jointly(measurements, q, 9, FAR, turns=1)
    entry = found.near[:, :, 0, 4, 8]
    beside, inner = entry[:, 4], entry[:, :3]
    assert np.mean(beside > 0.5 * faint) > 0.7
    assert np.mean(inner > 0.5 * faint) < 0.3


def test_steps_of_a_camera_that_is_as_fine_are_no_other_surface():
    y, x = np.meshgrid(np.arange(6.0), np.arange(7.0), indexing="ij")
    assert not seen_beside(np.stack([y, x], axis=-1), 5).any()


def test_a_q_that_is_a_little_off_is_put_right():
    generator = np.random.default_rng(4)
    camera = Size(12, 14)
    y, x = np.meshgrid(np.arange(2.0, 14.0), np.arange(3.0, 17.0), indexing="ij")
    true = np.stack([y, x], axis=-1) + generator.uniform(0.2, 0.45, (*camera, 2))
    world = model_transport(PROJECTOR, camera, window=WINDOW, far=Size(3, 3), entries=0)
    world = replace(world, correspondence=true.astype(np.float32), near=np.zeros_like(world.near))
    off = true + 0.01 * generator.normal(size=true.shape)
    measurements = _measure(
        world.dense().astype(np.float64), _frequencies(), noise=1e-3, camera=camera
    )
    found = estimate_jointly(measurements, off, WINDOW, FAR)
    before, after = (np.abs(q - true).mean() for q in (off, found.correspondence))
    assert after < 0.35 * before
    # It stays where it was rounded to.
    np.testing.assert_array_equal(np.rint(found.correspondence), np.rint(off))


def test_the_offset_of_the_references_is_taken_out():
    world = model_transport(PROJECTOR, Size(16, 20), window=WINDOW, far=Size(3, 3), entries=0)
    world = replace(world, near=np.zeros_like(world.near))
    rows = world.dense().astype(np.float64)
    frequencies = _frequencies()
    told = _measure(rows, frequencies, noise=1e-4, offset=0.02, camera=world.camera)
    untold = replace(told, white_noise=np.zeros_like(told.noise))
    light = np.asarray(exponential(frequencies[3], PROJECTOR).real)
    truth = world @ light
    errors = [
        np.linalg.norm(estimate_jointly(m, world.correspondence, WINDOW, FAR) @ light - truth)
        for m in (told, untold)
    ]
    assert errors[0] < 0.3 * errors[1]


def test_neighbours_that_agree_take_noise_away_and_edges_stay():
    generator = np.random.default_rng(0)
    truth = np.zeros((40, 40, 1, 3))
    truth[:, 20:] = 1.0
    noisy = truth + 0.05 * generator.normal(size=truth.shape)
    every = np.ones((40, 40), dtype=bool)
    variance = np.full((40, 40, 1), 0.05**2)
    found = expect_each(noisy, variance, np.ones(3))
    flat = np.abs(np.arange(40) - 19.5) > 2
    assert np.std((found - truth)[:, flat]) < 0.6 * 0.05
    assert np.abs((found - truth)[:, 19:21]).max() < 4 * 0.05
    together = expect_together(noisy, variance, every)
    assert np.std((together - truth)[:, flat]) < 0.6 * 0.05
    assert np.abs((together - truth)[:, 19:21]).max() < 4 * 0.05


def test_neighbours_without_a_say_are_not_heard():
    values = np.zeros((9, 9, 1, 2))
    values[4, 4] = 100.0
    known = np.ones((9, 9), dtype=bool)
    known[4, 4] = False
    found = expect_together(values, np.full((9, 9, 1), 1.0), known)
    assert not found.any()


def test_answers_without_white_are_refused():
    rows, _ = _draw(1, np.array([[8, 10]]), 0.01)
    measurements = _measure(rows, _frequencies())
    basis = real_basis(_frequencies(), PROJECTOR)
    lacking = replace(
        measurements,
        basis=basis,
        answers=measurements.answers[..., 1:],
        shown_error=measurements.shown_error[1:],
        repeats=measurements.repeats[1:],
    )
    with pytest.raises(InputError, match="lack white"):
        estimate_jointly(lacking, np.array([[[8.0, 10.0]]]), WINDOW, FAR)


def test_kinds_are_different():
    assert len(set(LIT)) == len(LIT)
