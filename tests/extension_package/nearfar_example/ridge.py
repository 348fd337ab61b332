"""Ridge regression of direct light and the far band; near-range light is left out."""

import numpy as np

from nearfar.estimate.base import Estimator, Memory
from nearfar.illumination.frequencies import far_frequencies, representatives
from nearfar.illumination.real_basis import RealBasis
from nearfar.transport.model import Transport

# Weight of the squared unknowns beside the squared residuals.
RIDGE = 1e-3


class RidgeEstimator(Estimator):
    """Least squares for d and f with a penalty on both."""

    def require(self, plan):
        """Refuse a plan of complex patterns."""
        plan.require_real("reconstruct")

    def memory(self, plan, channels):
        """Count the responses and the direct light's waves."""
        return Memory(shared=0, pixel=16 * channels * len(plan.patterns))

    def estimate(self, measurements, q, model, *, device="cpu", progress=None):
        """Solve the normal equations of [d, f] for each camera pixel."""
        basis, projector = measurements.basis, measurements.projector
        low = representatives(far_frequencies(model.far, projector))
        low = tuple(k for k in low if k in basis.frequencies)
        places = basis.response_indices(low)
        lit = np.isfinite(q).all(axis=-1).ravel()
        # What direct light of 1 at q answers to every cosine and sine, none where there is none.
        waves = basis.patterns_at(np.nan_to_num(q.reshape(-1, 2))).T * lit[:, None]
        # Unknowns of the far band are eliminated: they explain what the ridge leaves of it.
        weights = np.ones(basis.count)
        weights[places] = RIDGE / (1 + RIDGE)
        information = (weights * waves**2).sum(axis=1) + RIDGE
        score = np.einsum("cir,cr,r->ci", measurements.responses, waves, weights)
        direct = score / information[:, None]
        left = measurements.responses - direct[..., None] * waves[:, None]
        far = left[..., places] / (1 + RIDGE)
        shape = (*measurements.camera, measurements.channels)
        return Transport(
            projector=projector,
            correspondence=q.astype(np.float32),
            direct=direct.reshape(shape).astype(np.float32),
            near=np.zeros((*shape, model.window, model.window), np.float32),
            far=far.reshape(*shape, -1).astype(np.float32),
            far_basis=RealBasis(low, projector),
            black=measurements.black.reshape(shape),
            noise=measurements.noise.reshape(shape),
        )


RIDGE_ESTIMATOR = RidgeEstimator()
