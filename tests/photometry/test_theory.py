"""Measurements by theory: b_k = t . exp(-j 2 pi k.p) for each of the plan's frequencies."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import InputError, PlanError
from nearfar.estimate.paper import estimate
from nearfar.illumination.patterns import exponential
from nearfar.illumination.real_basis import RealBasis
from nearfar.photometry import theory
from nearfar.photometry.theory import measure_in_theory
from nearfar.plan import paper_plan
from tests.worlds import model_transport


def test_the_responses_are_those_of_the_complex_patterns():
    world = model_transport(Size(12, 20), Size(3, 4), window=5, far=Size(3, 4), channels=2)
    plan = paper_plan(
        world.projector, 5, Size(3, 4), dropped=Size(1, 1), offset="none", correspondence="none"
    )
    measured = measure_in_theory(plan, world)
    rows = world.dense().astype(np.float64)
    responses = measured.responses.astype(np.float64)
    for i, frequency in enumerate(measured.basis.frequencies):
        expected = rows @ exponential(frequency, world.projector).ravel()
        here = measured.basis.index == i
        cosine = responses[..., here & ~measured.basis.is_sine][..., 0]
        np.testing.assert_allclose(cosine, expected.real, atol=1e-6)
        sine = responses[..., here & measured.basis.is_sine]
        shown = sine[..., 0] if sine.shape[-1] else np.zeros_like(cosine)
        np.testing.assert_allclose(-shown, expected.imag, atol=1e-6)
    shot = {pattern.frequency for pattern in plan.patterns}
    assert all(k in shot or -k in shot for k in measured.basis.frequencies)


def test_measuring_in_small_blocks_changes_nothing(monkeypatch):
    world = model_transport(Size(12, 20), Size(3, 4), window=5, far=Size(3, 4), channels=2)
    plan = paper_plan(
        world.projector, 5, Size(3, 4), dropped=Size(1, 1), offset="none", correspondence="none"
    )
    whole = measure_in_theory(plan, world)
    largest = []
    rows, patterns_on = type(world).rows, RealBasis.patterns_on

    def told(values):
        largest.append(values.size)
        return values

    monkeypatch.setattr(type(world), "rows", lambda self, pixels: told(rows(self, pixels)))
    monkeypatch.setattr(
        RealBasis, "patterns_on", lambda self, lines: told(patterns_on(self, lines))
    )
    monkeypatch.setattr(theory, "VALUES_AT_ONCE", 1000)
    monkeypatch.setattr(theory, "VALUES_OF_ROWS", 999)
    parts = measure_in_theory(plan, world)
    np.testing.assert_allclose(parts.responses, whole.responses, atol=1e-6)
    assert max(largest) <= 1000
    assert len(largest) > 12
    # Each row is computed once: patterns are in blocks of 800 values, rows in pairs of 480.
    assert sum(size for size in largest if size % 480 == 0) == 12 * 2 * 240


def test_a_transport_that_obeys_the_model_is_recovered():
    far = Size(3, 4)
    world = model_transport(Size(12, 20), Size(6, 10), window=5, far=far, channels=1)
    plan = paper_plan(
        world.projector, 5, far, dropped=Size(1, 1), offset="none", correspondence="none"
    )
    found = estimate(measure_in_theory(plan, world), world.correspondence, 5, far, Size(1, 1))
    error = np.linalg.norm(found.dense() - world.dense()) / np.linalg.norm(world.dense())
    assert 20 * np.log10(1 / error) > 80


def test_plans_that_are_shot_and_other_projectors_are_refused():
    world = model_transport(Size(12, 20), Size(3, 4), window=5, far=Size(3, 3))
    with pytest.raises(PlanError, match="`offset='none'`"):
        measure_in_theory(paper_plan(world.projector, 5, Size(3, 3)), world)
    other = paper_plan(Size(20, 12), 5, Size(3, 3), offset="none")
    with pytest.raises(InputError, match=r"`projector=\(12, 20\)`"):
        measure_in_theory(other, world)
