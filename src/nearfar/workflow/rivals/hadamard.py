"""Hadamard multiplexing, by `nearfar.baselines.hadamard`."""

from nearfar.baselines.hadamard import Hadamard
from nearfar.workflow.rivals.reference import reference_rival

HADAMARD = reference_rival(
    Hadamard,
    title="Hadamard",
    line={"color": "#3f9e74", "marker": "D", "linestyle": ":"},
)
