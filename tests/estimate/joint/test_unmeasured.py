"""Prior components of error bars, by how they foretell frequencies that were not measured."""

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.evidence import best_of
from nearfar.estimate.joint.problem import build_model
from nearfar.estimate.joint.unmeasured import log_scores, responses_stood_for
from nearfar.illumination.frequencies import DC
from nearfar.illumination.near_basis import NearBasis
from nearfar.illumination.real_basis import real_basis
from nearfar.plan.candidates import lowest_first
from nearfar.priors.covariance import far_variance
from nearfar.priors.fitted import LIT_COMPONENTS, UNLIT_COMPONENTS

PROJECTOR = Size(15, 15)
FADES, HAS_OUTLINE = UNLIT_COMPONENTS[1], UNLIT_COMPONENTS[-2]
NOISE = 4e-3


@pytest.mark.parametrize("size", [Size(15, 15), Size(8, 12), Size(1, 16)])
def test_measured_responses_stand_for_all_others(size):
    listed = lowest_first(size)
    for measured in (listed, listed[: len(listed) // 3], [*listed[:3], listed[-1]]):
        stood_for = responses_stood_for(real_basis(measured, size))
        assert stood_for.min() >= 1
        assert stood_for.sum() == pytest.approx(size.pixels - 1)
    every = responses_stood_for(real_basis(listed, size))
    np.testing.assert_allclose(every, 1.0)


def test_a_few_high_responses_outweigh_many_low_ones():
    listed = lowest_first(PROJECTOR)
    low, high = listed[:40], listed[-2:]
    model = build_model(
        real_basis([DC, *low, *high], PROJECTOR),
        np.ones(1 + 2 * (len(low) + len(high)), dtype=np.float32),
        NearBasis(3, 1),
        "cpu",
    )
    basis = model.centred.basis
    # Low ones as a component that fades expects them, high ones as one with an outline does.
    is_high = np.isin(basis.index, [basis.frequencies.index(k) for k in high])
    expected = np.where(is_high, *(far_variance(basis, one) for one in (HAS_OUTLINE, FADES)))
    scale = 0.0064
    responses = np.sqrt(scale**2 * expected + NOISE**2)[None, None].astype(np.float32)
    one = np.ones((1, 1), dtype=np.float32)
    nothing = np.zeros((1, 0))
    batch = PixelBatch(
        *(nothing, nothing, nothing, responses, nothing, nothing, nothing),
        *(NOISE * one, 0.0 * one, one, nothing),
    )

    def chosen(stood_for):
        scores = log_scores(batch, model.unlit, model.multiplicity, stood_for)
        return best_of(scores, model.unlit)[0][0] - len(LIT_COMPONENTS)

    assert UNLIT_COMPONENTS[chosen(np.ones(basis.count))] == FADES
    assert UNLIT_COMPONENTS[chosen(model.stood_for)] == HAS_OUTLINE
