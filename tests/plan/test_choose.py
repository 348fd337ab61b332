"""Plans that are chosen for a number of photos."""

from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError, PlanError
from nearfar.illumination.frequencies import (
    CHECKERBOARD,
    DC,
    as_array,
    grid,
    representatives,
)
from nearfar.illumination.real_basis import real_basis
from nearfar.plan import choose_plan, parse_plan
from nearfar.plan.candidates import candidates
from nearfar.plan.choose import FEWEST_PHOTOS, photos_of_every_frequency
from nearfar.plan.choose_frequencies import choose_frequencies
from nearfar.plan.look import look_at, photos_for_window
from nearfar.plan.patterns import Sinusoid
from nearfar.plan.typical import noise_of, typical_of
from nearfar.priors.component import PriorComponent
from nearfar.priors.fitted import FREE, LIT_COMPONENTS, PRIOR_SCALES, TYPICAL_SCENES
from nearfar.transport.model import Transport
from nearfar.transport.posterior import Posterior


@pytest.mark.parametrize("photos", [FEWEST_PHOTOS, 61, 150])
@pytest.mark.parametrize("projector", [Size(16, 20), Size(31, 24), Size(33, 33)])
def test_a_plan_takes_no_more_photos_than_asked_for(projector, photos):
    plan, expected = choose_plan(projector, photos)
    assert photos - 1 <= len(plan.patterns) <= photos
    assert sum(plan.counts.values()) == len(plan.patterns)
    assert plan.counts["direct"] >= 1
    assert plan.counts["correspondence"] == 0
    assert (plan.offset, plan.correspondence) == ("reference", "phase")
    assert np.isfinite(expected).all()
    assert parse_plan(plan.to_json()) == plan
    for index in range(len(plan.patterns)):
        assert plan.draw(index).shape == projector


def test_every_chosen_frequency_has_its_cosine_and_its_sine():
    plan, _ = choose_plan(Size(16, 20), 60)
    waves = [p for p in plan.patterns if isinstance(p, Sinusoid)]
    shown = [(p.frequency, p.kind) for p in waves if p.frequency != DC]
    for frequency, kind in shown:
        if not frequency.is_own_negative:
            other = "sine" if kind == "cosine" else "cosine"
            assert shown.count((frequency, kind)) == shown.count((frequency, other))


def test_candidates_lie_on_the_grid_of_the_projector():
    projector = Size(20, 34)
    for k in candidates(projector, 7):
        assert k == CHECKERBOARD or (
            (k.fy * projector.height).denominator == 1 and (k.fx * projector.width).denominator == 1
        )
        assert k != DC


def test_more_photos_are_expected_to_do_better():
    expected = [choose_frequencies(Size(24, 24), n, 5).expected for n in (40, 80, 160)]
    assert np.all(np.diff([e.pictures for e in expected]) > 0)
    assert np.all(np.diff([e.random for e in expected]) > 0)


def test_the_lowest_frequencies_come_first_and_are_repeated():
    chosen = choose_frequencies(Size(32, 32), 200, 7).frequencies
    cycles = {k: max(abs(k.fy), abs(k.fx)) * 32 for k in chosen}
    repeated = [cycles[k] for k, count in chosen.items() if count > 1 and k != CHECKERBOARD]
    assert min(repeated) == 1
    assert np.mean(repeated) < np.mean(list(cycles.values()))


@pytest.mark.parametrize("projector", [Size(12, 10), Size(9, 11), Size(8, 9)])
@pytest.mark.parametrize("more", [14, 40])
def test_with_as_many_photos_as_unknowns_every_frequency_is_shown(projector, more):
    photos = projector.pixels + more
    plan, expected = choose_plan(projector, photos)
    counts = choose_frequencies(projector, photos, 5).frequencies
    basis = real_basis([DC, *counts], projector)
    assert np.linalg.matrix_rank(basis.patterns.astype(float)) == projector.pixels
    assert len(plan.patterns) <= photos
    assert expected.random > choose_plan(projector, projector.pixels)[1].random - 1.0


@pytest.mark.parametrize("checks", [None, 0])
def test_every_frequency_is_shown_as_soon_as_there_are_photos_for_it(checks):
    projector = Size(9, 12)
    photos = photos_of_every_frequency(projector) + (2 if checks is None else 0)
    for count, whole in ((photos, True), (photos - 1, False)):
        plan, _ = choose_plan(projector, count, checks=checks, every_frequency=True)
        shown = {p.frequency for p in plan.patterns if isinstance(p, Sinusoid)}
        basis = real_basis(list(shown), projector)
        rank = np.linalg.matrix_rank(basis.patterns.astype(float))
        assert (rank == projector.pixels) == whole
        assert len(plan.patterns) <= count


# The second is small enough, but its windows are of functions of several pixels.
@pytest.mark.parametrize("projector", [Size(1080, 1920), Size(200, 160)])
def test_more_frequencies_than_can_be_listed_are_refused(projector):
    with pytest.raises(PlanError, match="too many frequencies"):
        choose_plan(projector, 200, every_frequency=True)


def test_below_that_the_lowest_frequencies_of_all_are_shown():
    projector = Size(12, 12)
    plan, expected = choose_plan(projector, 80, every_frequency=True)
    shown = {p.frequency for p in plan.patterns if isinstance(p, Sinusoid)}
    every = representatives(grid(projector, projector))
    shown_cycles, cycles = (np.linalg.norm(as_array(some), axis=1) for some in (shown, every))
    assert shown_cycles.max() <= np.sort(cycles)[len(shown)]
    assert expected.pictures < choose_plan(projector, 160, every_frequency=True)[1].pictures


def test_more_noise_asks_for_more_repeats():
    quiet, loud = (choose_frequencies(Size(24, 24), 120, 5, noise=n) for n in (0.002, 0.05))
    assert len(loud.frequencies) < len(quiet.frequencies)


@pytest.mark.parametrize(
    ("projector", "photos", "window", "said"),
    [
        (Size(16, 16), 8, None, "too few"),
        (Size(4, 64), 60, None, "no pattern grid"),
        (Size(16, 20000), 60, None, "no pattern grid"),
        (Size(16, 16), 60, 17, "W = 17 does not fit"),
    ],
)
def test_what_cannot_be_chosen_is_said(projector, photos, window, said):
    with pytest.raises(PlanError, match=said):
        choose_plan(projector, photos, window=window)


def _quick_look(component, scale, noise=0.01, shape=(6, 8, 3)):
    """Make a transport whose camera pixels are all of one prior component."""
    generator = np.random.default_rng(0)
    basis = real_basis([DC], Size(24, 24))
    dark = np.zeros(shape, np.float32)
    white = generator.uniform(0.2, 1.0, shape).astype(np.float32)
    return Transport(
        projector=Size(24, 24),
        correspondence=np.zeros((*shape[:2], 2), np.float32),
        direct=dark,
        near=np.zeros((*shape, 5, 5), np.float32),
        far=np.zeros((*shape, 1), np.float32),
        far_basis=basis,
        black=dark,
        noise=noise * white,
        posterior=Posterior(
            prior_components=(LIT_COMPONENTS[0], component),
            frequencies=(),
            multiplicity=np.zeros(0, np.float32),
            prior_component=np.ones(shape[:2], np.uint8),
            prior_scale=np.full(shape[:2], scale, np.float32),
            white=white,
            offset_noise=dark,
            light_noise=dark,
            share_of_white=dark,
            noise_share=np.ones(shape, np.float32),
        ),
    )


def test_a_quick_look_gives_prior_components_and_noise():
    component = PriorComponent(6.0, 64.0, 8.0)
    look = _quick_look(component, PRIOR_SCALES[4], noise=0.02)
    found = typical_of(look)
    assert found.prior_components == ((component, pytest.approx(PRIOR_SCALES[4])),)
    np.testing.assert_allclose(found.shares, [[1.0]])
    assert noise_of(look) == pytest.approx(0.02, rel=1e-5)


def test_the_plan_follows_what_was_looked_at():
    def highest(component, scale):
        chosen = choose_frequencies(
            Size(24, 24), 90, 5, typical=typical_of(_quick_look(component, scale))
        ).frequencies
        return np.mean([np.hypot(float(k.fy), float(k.fx)) for k in chosen])

    # Far-range light alone asks for low frequencies, a rough window for all.
    smooth, rough = PriorComponent(0.8, 256.0, 3.0), PriorComponent(6.0, 1.0, 3.0, roughness=1.0)
    assert highest(smooth, 0.002) < highest(rough, 0.02)


def _with_near_light(look, reach):
    side = np.abs(np.arange(5) - 2)
    falling = np.exp(-np.maximum(side[:, None], side) / reach)
    near = 0.02 * np.broadcast_to(falling, look.near.shape)
    return replace(look, near=near.astype(np.float32))


def test_near_range_light_that_reaches_beyond_the_window_asks_for_a_larger_one():
    dark = _quick_look(PriorComponent(2.2, 16.0, 1.5), 0.006)
    close, wide, flat = (_with_near_light(dark, reach) for reach in (0.8, 1.7, 1e9))
    assert look_at(close).reach == pytest.approx(0.8, rel=0.01)
    assert look_at(close).wanted_window == 5
    seen = look_at(wide)
    assert (seen.reach, seen.wanted_window) == (pytest.approx(1.7, rel=0.01), 9)
    # A look tells little of what lies far beyond its own window.
    assert (look_at(flat).reach, look_at(flat).wanted_window) == (5.0, 9)
    assert (look_at(dark).reach, look_at(dark).wanted_window) == (None, 5)
    # More entries are unknown, which more photos make up for.
    seven, nine = (photos_for_window(seen, Size(24, 24), 60, window=window) for window in (7, 9))
    assert 60 < seven < nine < 240


def test_free_rows_say_that_the_model_does_not_hold():
    bound = _quick_look(PriorComponent(2.2, 16.0, 1.5), 0.006)
    free = _quick_look(PriorComponent(0.0, 64.0, FREE), 0.006)
    assert look_at(bound).model_holds
    assert look_at(free).free_share == 1.0
    assert not look_at(free).model_holds
    # Light with edges is known to be weaker at high frequencies.
    with_edges = _quick_look(PriorComponent(0.0, 64.0, FREE, far_power=1.5), 0.006)
    assert look_at(with_edges).model_holds


def test_a_look_without_prior_components_is_refused():
    look = replace(_quick_look(LIT_COMPONENTS[0], 0.01), posterior=None)
    for ask in (typical_of, noise_of, look_at):
        with pytest.raises(InputError, match="`method='joint'`"):
            ask(look)


def test_the_typical_scenes_are_whole():
    components, shares, weights = TYPICAL_SCENES
    assert np.all(shares >= 0)
    assert np.all((shares.sum(axis=1) > 0.8) & (shares.sum(axis=1) <= 1.001))
    assert shares.shape == (len(weights), len(components))


def test_what_a_plan_was_chosen_for_is_kept_in_its_file():
    plan, expected = choose_plan(Size(16, 16), 40)
    assert parse_plan(plan.to_json()) == plan
    for light in ("pictures", "random"):
        low, high = getattr(plan.expected_snr, light)
        assert low < getattr(expected, light) < high
    assert plan.first(40).expected_snr == plan.expected_snr
    assert plan.first(39).expected_snr is None
