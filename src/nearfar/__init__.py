"""Light transport between a projector and a camera: plan, acquire, reconstruct, relight.

After Reddy, Ramamoorthi and Curless, "Frequency-Space Decomposition and Acquisition of Light
Transport under Spatially Varying Illumination", ECCV 2012.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nearfar.arrays import Size, parse_size
    from nearfar.capture import open_capture, write_capture
    from nearfar.correspondence import (
        Correspondence,
        correspond_by_stripes,
        given_correspondence,
        read_correspondence,
    )
    from nearfar.errors import NearfarError
    from nearfar.illumination.pictures import natural_picture, penguin, random_pattern, white
    from nearfar.plan import Plan, choose_plan, paper_plan, parse_plan, read_plan
    from nearfar.progress import counted, progress_bar
    from nearfar.rigs.opening import open_rig, opened_rig
    from nearfar.transport.exact import ExactTransport
    from nearfar.transport.exact_store import load_exact, save_exact
    from nearfar.transport.model import Transport
    from nearfar.transport.prepared import prepare_transport
    from nearfar.transport.store import load_transport, save_transport
    from nearfar.version import version
    from nearfar.workflow.acquire import acquire
    from nearfar.workflow.check import check_model
    from nearfar.workflow.cluster import reconstruct_on
    from nearfar.workflow.conditioning import condition_near
    from nearfar.workflow.evaluate import relighting_snr, row_snr, snr
    from nearfar.workflow.reconstruct import reconstruct

# Where each public name lives; loaded when first asked for, so that importing stays quick.
_HOMES = {
    "Correspondence": "nearfar.correspondence",
    "ErrorBars": "nearfar.estimate.joint",
    "ExactTransport": "nearfar.transport.exact",
    "NearfarError": "nearfar.errors",
    "Plan": "nearfar.plan",
    "Size": "nearfar.arrays",
    "Transport": "nearfar.transport.model",
    "acquire": "nearfar.workflow.acquire",
    "check_model": "nearfar.workflow.check",
    "counted": "nearfar.progress",
    "condition_near": "nearfar.workflow.conditioning",
    "correspond_by_stripes": "nearfar.correspondence",
    "given_correspondence": "nearfar.correspondence",
    "load_exact": "nearfar.transport.exact_store",
    "load_transport": "nearfar.transport.store",
    "natural_picture": "nearfar.illumination.pictures",
    "open_capture": "nearfar.capture",
    "open_rig": "nearfar.rigs.opening",
    "opened_rig": "nearfar.rigs.opening",
    "choose_plan": "nearfar.plan",
    "paper_plan": "nearfar.plan",
    "parse_plan": "nearfar.plan",
    "parse_size": "nearfar.arrays",
    "progress_bar": "nearfar.progress",
    "prepare_transport": "nearfar.transport.prepared",
    "penguin": "nearfar.illumination.pictures",
    "random_pattern": "nearfar.illumination.pictures",
    "read_correspondence": "nearfar.correspondence",
    "read_plan": "nearfar.plan",
    "reconstruct": "nearfar.workflow.reconstruct",
    "reconstruct_on": "nearfar.workflow.cluster",
    "relighting_snr": "nearfar.workflow.evaluate",
    "row_snr": "nearfar.workflow.evaluate",
    "save_exact": "nearfar.transport.exact_store",
    "save_transport": "nearfar.transport.store",
    "snr": "nearfar.workflow.evaluate",
    "version": "nearfar.version",
    "white": "nearfar.illumination.pictures",
    "write_capture": "nearfar.capture",
}

__all__ = [
    "Correspondence",
    "ErrorBars",
    "ExactTransport",
    "NearfarError",
    "Plan",
    "Size",
    "Transport",
    "acquire",
    "check_model",
    "choose_plan",
    "condition_near",
    "correspond_by_stripes",
    "counted",
    "given_correspondence",
    "load_exact",
    "load_transport",
    "natural_picture",
    "open_capture",
    "open_rig",
    "opened_rig",
    "paper_plan",
    "parse_plan",
    "parse_size",
    "penguin",
    "prepare_transport",
    "progress_bar",
    "random_pattern",
    "read_correspondence",
    "read_plan",
    "reconstruct",
    "reconstruct_on",
    "relighting_snr",
    "row_snr",
    "save_exact",
    "save_transport",
    "snr",
    "version",
    "white",
    "write_capture",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'nearfar' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
