"""The far band of a transport, beyond which f holds what was measured there."""

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from nearfar.arrays import Floats
from nearfar.illumination.real_basis import RealBasis

# Of a frequency, far below the distance of two.
TOLERANCE = 1e-9


class Banded(Protocol):
    """The attributes of `nearfar.Transport` that the far band follows from."""

    @property
    def far_basis(self) -> RealBasis:
        """Frequencies of f."""

    @property
    def provenance(self) -> Mapping[str, Any]:
        """How it was made; its plan names the far band."""


def band_edge(transport: Banded) -> Floats:
    """Return k_far, the highest frequencies of f within the plan's far band, (fy, fx).

    Cycles per projector pixel; of all frequencies of f where no plan is known.
    """
    basis = transport.far_basis
    cycles = np.abs(basis.cycles)
    plan = transport.provenance.get("plan")
    band = plan.get("far") if isinstance(plan, Mapping) else None
    if band is not None:
        edge = (np.array(band) // 2) / np.array(basis.projector)
        cycles = cycles[np.all(cycles <= edge + TOLERANCE, axis=1)]
    return np.asarray(cycles.max(axis=0, initial=0.0))
