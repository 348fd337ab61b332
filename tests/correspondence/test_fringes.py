"""Phase shifting and the response it tells of, in theory and on real photos."""

import os
from pathlib import Path

import numpy as np
import pytest

from nearfar.correspondence.gray import decode_axis
from nearfar.errors import InputError
from nearfar.files import read_picture
from nearfar.photometry.modulation import LARGEST_SHARE_ABOVE, of_pair, share_above_one
from tests.correspondence.phase_shifting import fit_exponent, of_steps, position_in_period, unwrap

PHASES = np.deg2rad([-120.0, 0.0, 120.0])
PERIODS = (200 / 3, 100.0)
CELL = 100


def _fringes(x, period, gamma=1.0, phases=PHASES):
    return np.stack([(0.5 + 0.5 * np.cos(2 * np.pi * x / period + p)) ** gamma for p in phases])


@pytest.mark.parametrize("steps", [3, 4, 7])
def test_positions_are_found_where_the_response_is_linear(steps):
    x = np.linspace(0, 1000, 5001)
    phases = 2 * np.pi * np.arange(steps) / steps
    for period in PERIODS:
        phase, modulation = of_steps(0.3 * _fringes(x, period, phases=phases), phases)
        found = unwrap(position_in_period(phase, period), period, x + 0.45 * period)
        np.testing.assert_allclose(found, x, atol=1e-9)
        np.testing.assert_allclose(modulation, 1.0)


def test_phases_that_are_not_even_are_refused():
    for phases in ([0.0, np.pi], [0.0, 1.0, 2.0]):
        with pytest.raises(InputError, match="not shifted evenly"):
            of_steps(np.zeros((len(phases), 4)), phases)


@pytest.mark.parametrize("gamma", [0.45, 1.0, 2.2])
def test_fringes_tell_the_response(gamma):
    x = np.random.default_rng(0).uniform(0, 1000, 4000)
    shone = _fringes(x, 100.0, gamma)
    assert fit_exponent(shone) == pytest.approx(1 / gamma, rel=1e-3)
    _, modulation = of_steps(shone, PHASES)
    lit = np.ones(x.size, dtype=bool)
    assert (share_above_one(modulation, lit) > LARGEST_SHARE_ABOVE) == (gamma > 1)
    _, straight = of_steps(shone ** (1 / gamma), PHASES)
    assert share_above_one(straight, lit) == 0


def test_a_pair_is_modulated_as_its_phase_does_not_matter():
    x = np.linspace(0, 1, 100)
    cosine, sine = (0.2 + 0.6 * (0.5 + 0.4 * f(2 * np.pi * x)) for f in (np.cos, np.sin))
    modulation = of_pair(cosine, sine, np.full(100, 0.2), np.full(100, 0.8))
    np.testing.assert_allclose(modulation, 0.8)


def _folder():
    """Where the photos of a real projector are; they are not ours to hand on."""
    beside = Path(__file__).parents[2].parent / "shared" / "data" / "phase-shifting-object1"
    return Path(os.environ.get("NEARFAR_REAL_PHOTOS", beside))


@pytest.fixture(scope="module")
def real_photos():
    if not (_folder() / "pat31.png").exists():
        pytest.skip("there are no real photos: name their folder in NEARFAR_REAL_PHOTOS")
    return np.stack(
        [read_picture(_folder() / f"pat{i:02d}.png").astype(np.float32) for i in range(32)]
    )


# Fringes of both periods, first photo of the Gray code, its bits and cells.
AXES = {"x": ((0, 3), 12, 5, 20), "y": ((6, 9), 22, 4, 11)}


@pytest.mark.slow
@pytest.mark.parametrize("axis", AXES)
def test_real_fringes_of_two_periods_agree_better_once_straightened(real_photos, axis):
    fringes, first, bits, cells = AXES[axis]
    white, black = real_photos[30], real_photos[31]
    # The coarsest bit was shot first.
    pairs = real_photos[first : first + 2 * bits].reshape(bits, 2, -1)[::-1]
    differences = pairs[:, 0] - pairs[:, 1]
    code = decode_axis(differences.astype(np.float64), np.ones(white.size), cells)
    lit = (white - black > 20) & (white < 250)
    lit &= (np.abs(differences).min(axis=0) > 8).reshape(white.shape)
    lit &= code.inside.reshape(white.shape)
    cell = np.floor(code.place.reshape(white.shape)[lit] + 0.5)

    def light(start):
        return (real_photos[start : start + 3, lit] - black[lit]) / (white - black)[lit]

    def disagreement(exponent):
        """Median distance of the positions by both periods, and how many modulate too much."""
        found, above = [], []
        for start in fringes:
            steps = np.clip(light(start), 0, None) ** exponent
            phase, modulation = of_steps(steps, PHASES)
            found.append(phase)
            above.append(share_above_one(modulation, np.ones(phase.size, dtype=bool)))
        coarse = position_in_period(found[1], CELL) + CELL * cell
        fine = unwrap(position_in_period(found[0], PERIODS[0]), PERIODS[0], coarse)
        return float(np.median(np.abs(fine - coarse))), min(above)

    exponent = fit_exponent(np.concatenate([light(start) for start in fringes], axis=-1))
    as_taken, alarm = disagreement(1.0)
    straightened, after = disagreement(exponent)
    print(
        f"{axis}: {as_taken:.2f} px, {alarm:.1%}; ^{exponent:.3f}: {straightened:.2f}, {after:.1%}"
    )
    assert lit.sum() > 1_000_000
    assert as_taken < 4.0
    assert straightened < 0.75 * as_taken
    # The alarm of modulation above 1, as the photos' README says.
    assert alarm > 0.4
    assert alarm > LARGEST_SHARE_ABOVE
    assert after < alarm / 3
