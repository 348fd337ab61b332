"""The error of a transport, from photos that were weighed together."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.plan import paper_plan
from nearfar.workflow.verdict.check_pairs import over_both
from nearfar.workflow.verdict.correspondence_lights import FEWEST_LINES, correspondence_lights
from nearfar.workflow.verdict.weighed_photos import NOISE_MODEL_ERROR, compare_weighed

VALUES = 40_000


@pytest.mark.parametrize("correspondence", ["stripes", "gray"])
@pytest.mark.parametrize("projector", [Size(8, 8), Size(13, 24), Size(5, 16)])
def test_weighed_patterns_are_the_light(correspondence, projector):
    plan = paper_plan(projector, 3, (3, 3), correspondence=correspondence)
    lights = correspondence_lights(plan)
    assert lights
    for light in lights:
        shown = sum(
            weight * plan.draw(number) / 255.0
            for number, weight in zip(light.photos, light.weights, strict=True)
        )
        np.testing.assert_allclose(shown, light.light - light.level, atol=1e-6)
        assert sum(light.weights) == pytest.approx(0.0, abs=1e-12)
        assert light.has_inverse == (correspondence == "gray")


@pytest.mark.parametrize("correspondence", ["stripes", "gray"])
def test_lights_are_few_on_any_projector(correspondence):
    found = [
        correspondence_lights(paper_plan((16, side), 3, (3, 3), correspondence=correspondence))
        for side in (16, 300)
    ]
    assert len(found[0]) == len(found[1]) <= 10
    assert sum(not light.is_fine for light in found[0]) == 4


def test_coarse_lights_are_as_wide_as_a_quarter_of_the_screen():
    for light in correspondence_lights(paper_plan((32, 32), 3, (3, 3))):
        of_line = light.light.reshape(8, 4, 8, 4).mean(axis=(1, 3))
        assert light.is_fine != (set(np.unique(of_line)) <= {0.0, 1.0})


def test_incomplete_stripes_and_small_projectors_show_nothing():
    plan = paper_plan((16, 16), 3, (3, 3))
    assert correspondence_lights(plan.first(len(plan.patterns) - 1))[-1].description.startswith(
        "row"
    )
    side = FEWEST_LINES - 1
    assert correspondence_lights(paper_plan((side, side), 3, (3, 3))) == []
    assert correspondence_lights(paper_plan((16, 16), 3, (3, 3), correspondence="phase")) == []


def _compared(*, error=0.01, noise=0.03, gain=1.0, claimed=None, with_inverse=True):
    """Relight with an error; photograph a light and its inverse with noise, and a lamp's gain."""
    generator = np.random.default_rng(1)
    white = generator.uniform(0.1, 0.9, VALUES)
    known = white * generator.uniform(0, 1, VALUES)
    relit = known - white / 2 + error * generator.normal(size=VALUES)
    one, other = (
        gain * picture + noise * generator.normal(size=VALUES) for picture in (known, white - known)
    )
    return compare_weighed(
        (one - other) / 2,
        relit,
        level=0.5,
        white=white,
        noise=(noise**2 if claimed is None else claimed) / 2,
        mean=(one + other) / 2 if with_inverse else None,
    )


@pytest.mark.parametrize("claimed", [None, 1e-5, 1.0])
def test_the_inverse_tells_the_noise_without_a_model_of_it(claimed):
    found = _compared(error=0.02, claimed=claimed)
    # Where the model is far too small, it is believed and the error is overestimated.
    assert found.error > 0.9 * 0.02**2
    if claimed != 1e-5:
        assert found.error == pytest.approx(0.02**2, rel=0.1)
        assert found.photo_noise == pytest.approx(0.03**2 / 2, rel=0.05)


def test_without_an_inverse_the_model_of_the_noise_tells_it_up_to_its_own_error():
    found = _compared(error=0.02, with_inverse=False)
    assert found.error == pytest.approx(0.02**2, rel=0.1)
    assert found.error_deviation >= NOISE_MODEL_ERROR * found.noise
    hidden = _compared(error=0.0, claimed=0.97 * 0.03**2, with_inverse=False)
    assert hidden.error < 3 * hidden.error_deviation


@pytest.mark.parametrize("with_inverse", [True, False])
def test_a_brighter_lamp_is_no_error_but_in_the_pattern(with_inverse):
    found = _compared(error=0.0, noise=0.001, gain=1.05, with_inverse=with_inverse)
    assert found.error < 0.05**2 * found.signal
    if with_inverse:
        assert found.excess_share == pytest.approx(0.05, rel=0.02)


def test_what_is_proportional_to_white_is_left_out_over_all_pixels_together():
    generator = np.random.default_rng(0)
    white = generator.uniform(0.1, 0.9, (2, VALUES))
    shown = 0.3 * white + 0.01 * generator.normal(size=white.shape)

    def compared(some):
        return compare_weighed(shown[some], 0 * white[some], level=0.0, white=white[some], noise=0)

    both = over_both(compared(0), compared(1))
    assert both.values == 2 * VALUES
    assert both.error == pytest.approx(0.01**2, rel=0.02)
    assert vars(both) == pytest.approx(vars(compared(slice(None))), nan_ok=True)
