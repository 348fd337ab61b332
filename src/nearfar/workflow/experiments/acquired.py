"""Scenes acquired with the patterns and counts of the paper, with the noise of a real camera.

Sections 5.1 and 5.2: inverse pairs, correspondence by stripes, relighting beside the exact picture.
"""

import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size
from nearfar.callbacks import Report
from nearfar.correspondence import Correspondence
from nearfar.illumination.pictures import landscape, penguin, white
from nearfar.plan import Plan, paper_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.transport.exact import ExactTransport
from nearfar.transport.model import Transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.evaluate import percentiles, relighting_snr, row_snr
from nearfar.workflow.experiments.data import Data
from nearfar.workflow.reconstruction.reconstruct import reconstruct


@dataclass(frozen=True, eq=False)
class Acquisition:
    """A scene to acquire.

    Attributes
    ----------
    scene : str
    projector : Size
    window : int
        W.
    far : Size
    light : callable
        Draws the picture to relight under, beside white.
    scan_line : float
        Height of the scan line, as a share of the camera's.
    """

    scene: str
    projector: Size
    window: int
    far: Size
    light: Callable[[Size], Floats]
    scan_line: float

    @property
    def plan(self) -> Plan:
        """The paper's plan, with inverse pairs and stripes."""
        return paper_plan(self.projector, self.window, self.far)


# Figures 1 and 2; figure 4.
BOX = Acquisition("cornell", Size(128, 128), 19, Size(13, 13), penguin, 0.6)
CORNER = Acquisition("corner", Size(128, 128), 15, Size(13, 13), landscape, 0.55)


def acquire_scene(case: Acquisition, report: Report) -> Data:
    """Acquire a scene, reconstruct it, and compare it with the truth.

    Parameters
    ----------
    case : Acquisition
    report : callable
        Called with what is being done and the share done.

    Returns
    -------
    Data
        Arrays: ``light``, relit components and exact pictures under it and under white, slices
        of T along the scan line (camera by projector pixels, mean over channels), ``snr_t`` and
        ``snr_b`` as maps. Numbers: photos, savings, SNR, seconds.
    """
    truth = cached_scene(case.scene, case.projector, progress=report)
    plan = case.plan
    rig = SimulatedRig(truth, case.scene, SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    with tempfile.TemporaryDirectory(prefix="nearfar-") as folder:
        started = time.monotonic()
        capture = acquire(
            plan,
            Path(folder) / "capture.zarr",
            rig,
            progress=report,
        )
        shot = time.monotonic()
        transport, correspondence = reconstruct(capture, method="paper", progress=report)
        done = time.monotonic()
    lights = {"white": white(case.projector), "picture": case.light(case.projector)}
    rows = row_snr(transport, truth, progress=report)
    arrays: dict[str, NDArray[Any]] = {"snr_t": rows.snr_t, "snr_b": rows.snr_b_of_frequency}
    arrays |= {f"{name}/light": light for name, light in lights.items()}
    arrays |= relit(transport, truth, lights)
    arrays |= slices(transport, truth, case.scan_line)
    numbers = {
        "scene": case.scene,
        "line": int(case.scan_line * truth.camera.height),
        "projector": list(case.projector),
        "window": case.window,
        "far": list(case.far),
        "dropped": list(plan.dropped),
        "plan": plan.summary(),
        "savings_in_theory": savings_in_theory(case.projector, case.window, case.far),
        "slice_off": _off_by_decade(arrays["slice"], arrays["slice/exact"]),
        "snr_b": relighting_snr(transport, truth, lights),
        "snr_b_frequency": percentiles(rows.snr_b_of_frequency),
        "snr_t": percentiles(rows.snr_t),
        "lit": _share_found(correspondence, truth),
        "seconds": {"photos": shot - started, "reconstruction": done - shot},
    }
    return Data({name: thin(values) for name, values in arrays.items()}, numbers)


def relit(
    transport: Transport, truth: ExactTransport, lights: Mapping[str, Floats]
) -> dict[str, Floats]:
    """Relight: ``LIGHT/direct``, ``near``, ``far``, ``sum`` and ``exact``, each (Cy, Cx, 3)."""
    pictures: dict[str, Floats] = {}
    for name, light in lights.items():
        parts = transport.components(light)
        pictures |= {f"{name}/{part}": values for part, values in parts._asdict().items()}
        pictures[f"{name}/sum"] = parts.direct + parts.near + parts.far
        pictures[f"{name}/exact"] = truth @ light
    return pictures


def slices(transport: Transport, truth: ExactTransport, scan_line: float) -> dict[str, Floats]:
    """Cut T along a row of the camera and of the projector, mean over channels.

    Returns
    -------
    dict
        ``slice``, ``slice/exact``, and the singular values of both.
    """
    camera, projector = transport.camera, transport.projector
    y, row = int(scan_line * camera.height), int(scan_line * projector.height)
    pixels = slice(y * camera.width, (y + 1) * camera.width)
    columns = slice(row * projector.width, (row + 1) * projector.width)
    cut = {
        "slice": transport.rows(pixels).mean(axis=1)[:, columns],
        "slice/exact": truth.rows(pixels).mean(axis=1)[:, columns],
    }
    singular = {
        f"{name}/singular": np.linalg.svd(values.astype(np.float64), compute_uv=False)
        for name, values in cut.items()
    }
    return cut | singular


def savings_in_theory(projector: Size, window: int, far: Size) -> float:
    """Equation (13): P over 1 + W^2 + |K_far|."""
    return projector.pixels / (1 + window**2 + far.pixels)


def thin(values: NDArray[Any]) -> NDArray[Any]:
    """Keep what a plot needs: float32."""
    return values.astype(np.float32) if values.dtype.kind == "f" else values


def _off_by_decade(found: Floats, exact: Floats) -> dict[str, float]:
    """Median relative error of entries of 10^n to 10^(n+1) of the largest, by n as text."""
    level = np.log10(np.maximum(np.abs(exact), 1e-300) / np.abs(exact).max())
    chosen = {n: (level >= n) & (level < n + 1) for n in (-2, -3, -4)}
    off = np.abs(found - exact) / np.maximum(np.abs(exact), 1e-300)
    return {
        str(n): float(np.median(off[mine])) if mine.any() else 0.0 for n, mine in chosen.items()
    }


def _share_found(correspondence: Correspondence, truth: ExactTransport) -> float:
    """Share of the camera pixels with direct light that were found, within one pixel."""
    lit = truth.lit
    off = np.abs(correspondence.q - truth.correspondence).max(axis=-1)
    return float(np.mean(off[lit] <= 1.0))
