"""Adaptive dual photography, by `nearfar.baselines.adaptive_dual`; of some thresholds the best."""

from nearfar.baselines.adaptive_dual import FEWEST_PHOTOS, adaptive_dual
from nearfar.workflow.rivals.halving import attempts_from
from nearfar.workflow.rivals.rival import Rival

# In photo units.
THRESHOLDS = (0.003, 0.01, 0.03, 0.1, 0.3)

ADAPTIVE_DUAL = Rival(
    title="adaptive dual",
    assumes="each camera pixel is lit from few blocks of the projector",
    line={"color": "#6b8e23", "marker": "P", "linestyle": "-."},
    attempts=attempts_from(adaptive_dual, THRESHOLDS, FEWEST_PHOTOS),
    is_dense=True,
)
