"""Symmetric photography, by `nearfar.baselines.symmetric`; of some tolerances the best."""

from nearfar.baselines.symmetric import FEWEST_PHOTOS, symmetric_photography
from nearfar.workflow.rivals.coaxial import why_not_coaxial
from nearfar.workflow.rivals.halving import attempts_from
from nearfar.workflow.rivals.rival import Rival

# In photo units.
TOLERANCES = (0.001, 0.003, 0.01, 0.03, 0.1)

SYMMETRIC = Rival(
    title="symmetric",
    assumes="coaxial camera, so that T is square and symmetric; far from its diagonal, blocks of "
    "T of rank one",
    line={"color": "#a8326e", "marker": "h", "linestyle": "-."},
    attempts=attempts_from(symmetric_photography, TOLERANCES, FEWEST_PHOTOS),
    is_dense=True,
    unsuited=why_not_coaxial,
)
