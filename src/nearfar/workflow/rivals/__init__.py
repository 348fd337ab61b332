"""Rival methods of measuring light transport, which `nearfar.workflow.compare` runs side by side.

A rival is one file, which holds a `nearfar.workflow.rivals.rival.Rival`, and one line of `RIVALS`.
"""

from nearfar.registry import Registry
from nearfar.workflow.rivals.rival import Rival

# In the order of tables and plots.
RIVALS: Registry[Rival] = Registry(
    "method",
    "nearfar.rivals",
    {
        "joint": "nearfar.workflow.rivals.joint:JOINT",
        "paper": "nearfar.workflow.rivals.paper:PAPER",
        "CLT": "nearfar.workflow.rivals.compressive:COMPRESSIVE",
        "Arnoldi": "nearfar.workflow.rivals.arnoldi:ARNOLDI",
        "Arnoldi after D": "nearfar.workflow.rivals.arnoldi:ARNOLDI_AFTER_DIRECT",
        "parallel single-pixel": (
            "nearfar.workflow.rivals.parallel_single_pixel:PARALLEL_SINGLE_PIXEL"
        ),
        "adaptive dual": "nearfar.workflow.rivals.adaptive_dual:ADAPTIVE_DUAL",
        "symmetric": "nearfar.workflow.rivals.symmetric:SYMMETRIC",
        "Hadamard": "nearfar.workflow.rivals.hadamard:HADAMARD",
        "brute force": "nearfar.workflow.rivals.brute_force:BRUTE_FORCE",
    },
    Rival,
)
