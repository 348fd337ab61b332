"""Pictures under the patterns of a plan, relit a few patterns at a time."""

import numpy as np

from nearfar.arrays import Size
from nearfar.plan import paper_plan
from nearfar.workflow.diagnosis import misfit
from tests.worlds import model_transport


def test_relit_photos_do_not_depend_on_how_many_patterns_are_drawn_at_a_time(monkeypatch):
    projector = Size(8, 9)
    plan = paper_plan(projector, 3, Size(3, 3), correspondence="none")
    transport = model_transport(projector, Size(5, 6), window=3, far=Size(3, 3), channels=3)
    numbers = [0, 7, 3, 11, 2]
    dense = transport.dense().reshape(5, 6, 3, projector.pixels)
    monkeypatch.setattr(misfit, "MOST_DRAWN", 2 * projector.pixels)
    found = misfit.relight(plan, transport, iter(numbers))
    assert found.shape == (5, 5, 6, 3)
    for picture, number in zip(found, numbers, strict=True):
        expected = dense @ (plan.draw(number).ravel() / 255)
        np.testing.assert_allclose(picture, expected + transport.black, atol=1e-5)
