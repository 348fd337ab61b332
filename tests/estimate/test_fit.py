"""The ceiling: the model fitted to a transport that is known."""

from dataclasses import replace

import numpy as np
from scipy import sparse

from nearfar.arrays import Size
from nearfar.estimate.fit import fit_model
from nearfar.transport import near
from nearfar.transport.exact import ExactTransport
from tests.worlds import model_transport

PROJECTOR, CAMERA, WINDOW, FAR = Size(20, 24), Size(6, 7), 5, Size(3, 3)


def _exact_of(world):
    d, n, f = world.component_rows(slice(None))

    def thin(part):
        return tuple(sparse.csr_array(part[:, i]) for i in range(world.channels))

    far = np.ascontiguousarray(np.moveaxis(f, 1, 0))
    return ExactTransport(world.projector, world.camera, thin(d), thin(n), far)


def test_a_transport_that_obeys_the_model_is_its_own_fit():
    world = model_transport(PROJECTOR, CAMERA, window=WINDOW, far=FAR, channels=2)
    fitted = fit_model(_exact_of(world), WINDOW, world.far_basis)
    truth = world.dense()
    assert np.linalg.norm(fitted.dense() - truth) < 1e-4 * np.linalg.norm(truth)
    np.testing.assert_allclose(fitted.near, world.near, atol=1e-4)
    np.testing.assert_allclose(fitted.direct, world.direct, atol=1e-6)


def test_no_other_n_and_f_fit_better():
    generator = np.random.default_rng(1)
    world = model_transport(PROJECTOR, CAMERA, window=WINDOW, far=FAR)
    exact = _exact_of(world)
    exact = replace(
        exact, far=exact.far + 0.01 * generator.random(exact.far.shape, dtype=np.float32)
    )
    fitted = fit_model(exact, WINDOW, world.far_basis)
    rows = exact.rows(slice(None))[:, 0] - fitted.component_rows(slice(None)).direct[:, 0]
    centres = near.centre(fitted.correspondence, PROJECTOR)
    inside = near.inside(centres, WINDOW, PROJECTOR)
    places = near.window_pixels(centres, WINDOW, PROJECTOR)
    for c in range(0, CAMERA.pixels, 5):
        identity = np.eye(PROJECTOR.pixels)[places[c][inside[c]]]
        basis = np.concatenate([identity, world.far_basis.patterns])
        best, *_ = np.linalg.lstsq(basis.T, rows[c], rcond=None)
        least = np.linalg.norm(rows[c] - best @ basis)
        found = np.linalg.norm(exact.rows(slice(c, c + 1)) - fitted.rows(slice(c, c + 1)))
        assert found < 1.01 * least + 1e-6
