"""Reconstruction of some rows of the camera: what all blocks share, and the work on one.

What neighbours tell each other across the border of two blocks is computed for both, so a block
does not depend on how the rest of the camera is cut but for two things that are taken over its
own rows: the noise model of inverse pairs, and what is a usual step of q (which way round surfaces
are seen, in correspondence by phase).
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from threadpoolctl import threadpool_limits

from nearfar.arrays import blocks
from nearfar.capture import Capture, white_and_black
from nearfar.correspondence import (
    Correspondence,
    correspond_by_phase,
    correspond_by_photos,
    has_correspondence_photos,
)
from nearfar.devices import Device, require_device
from nearfar.errors import InputError
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import PhotosWithoutDrift, remove_drift
from nearfar.photometry.measure import measure
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import Photos
from nearfar.plan import Plan
from nearfar.release import version
from nearfar.transport.half import in_half, rounding_over_noise
from nearfar.transport.model import Transport
from nearfar.transport.quality import Quality
from nearfar.transport.rows import of_rows
from nearfar.workflow.methods import ESTIMATORS, Estimate, Method

# Bytes of memory that a reconstruction takes at most, unless told otherwise.
MEMORY = 2 * 10**9
# What Python and the libraries take of them.
LIBRARIES = 4 * 10**8
# What arrays that come and go add to those that are counted.
SLACK = 1.5
# Blocks of so many rows twice over, or more, are of a multiple of them: chunks in a file divide
# blocks, and need not be small.
EVEN = 8

Progress = Callable[[str, float], None]


class Part(NamedTuple):
    """Some rows of the camera, reconstructed."""

    transport: Transport
    correspondence: Correspondence


class Cut(NamedTuple):
    """How the camera's rows are cut into blocks.

    Attributes
    ----------
    height : int
        Rows of the camera.
    rows : int
        Rows of a block.
    halo : int
        Rows beside a block that tell something of it.
    """

    height: int
    rows: int
    halo: int

    def blocks(self) -> Iterator[slice]:
        """Cut the camera's rows."""
        return blocks(self.height, self.rows)

    def around(self, block: slice) -> slice:
        """Return the rows that a block hears of: its own, and those beside it."""
        return slice(max(0, block.start - self.halo), min(self.height, block.stop + self.halo))

    def known_around(
        self, block: slice, correspondence: Correspondence | None
    ) -> Correspondence | None:
        """Return what a block hears of a correspondence, if it is given."""
        return None if correspondence is None else correspondence.of_rows(self.around(block))

    def report_of(self, block: slice, report: Progress) -> Callable[[float], None]:
        """Return what reports the share of a block as that of the whole camera."""

        def done(share: float) -> None:
            rows = block.start + share * (block.stop - block.start)
            report("reconstructing", rows / self.height)

        return done


@dataclass(frozen=True)
class Job:
    """What all blocks of a reconstruction share.

    Attributes
    ----------
    capture : Capture
    photos : Photos
        The capture's, without drift.
    method : {"joint", "paper"}
    cut : Cut
    brightest : float
        Largest white less black of the whole camera.
    device : {"cpu", "cuda", "torch"}
    estimate : callable
        The method's, as `nearfar.workflow.methods.Estimator` has it.
    half : bool
        Whether n and f are made float16.
    """

    capture: Capture
    photos: Photos
    method: Method
    cut: Cut
    brightest: float
    device: Device
    estimate: Estimate
    half: bool = False


def prepare(
    capture: Capture,
    *,
    method: Method,
    memory: int,
    given: bool,
    device: Device = "cpu",
    half: bool = False,
    photos: Photos | None = None,
    report: Progress | None = None,
) -> Job:
    """Read what all blocks share: references, and the brightest white.

    Parameters
    ----------
    capture : Capture
    method : {"joint", "paper"}
    memory : int
        Bytes to work in.
    given : bool
        Whether the correspondence is.
    device : {"cpu", "cuda", "torch"}
    half : bool
        Whether n and f are made float16.
    photos : Photos, optional
        The capture's, where they are held already.
    report : callable, optional
        As `nearfar.reconstruct` takes it.

    Raises
    ------
    PlanError
        If the plan's patterns are complex, or not the paper's for its method.
    InputError
        If the plan by reference has too few whites and blacks, or a row of the camera does not
        fit in the memory, or the device is not there.
    """
    require_device(device)
    cut = cut_rows(capture, method=method, memory=memory, given=given)
    read = without_drift(photos or capture, report or unheard)
    estimate = ESTIMATORS[method].estimate
    return Job(capture, read, method, cut, brightest_white(read), device, estimate, half)


def cut_rows(capture: Capture, *, method: Method, memory: int, given: bool) -> Cut:
    """Cut the camera into blocks of rows that may be worked at in so many bytes; see `prepare`."""
    estimator = ESTIMATORS[method]
    estimator.require(capture.plan)
    # Seeing which way round q runs takes a row more than the neighbours' own estimates.
    by_phase = not given and not has_correspondence_photos(capture.plan)
    halo = estimator.halo + (1 if by_phase else 0)
    return Cut(capture.camera.height, rows_at_once(capture, method, memory), halo)


def reconstruct_block(
    job: Job,
    block: slice,
    known: Correspondence | None = None,
    progress: Callable[[float], None] | None = None,
) -> Part:
    """Reconstruct some rows of the camera.

    Every product of matrices stays on one processor, several of them side by side, so that what
    comes out does not depend on how many there are.

    Parameters
    ----------
    job : Job
    block : slice
        One of the job's.
    known : Correspondence, optional
        Of the rows around the block, if it is given.
    progress : callable, optional
        Called with the share done.

    Returns
    -------
    Part
        The provenance's `excess_of_sums` and `rounding` are the block's own.
    """
    whole = job.cut.around(block)
    core = slice(block.start - whole.start, block.stop - whole.start)
    plan = job.capture.plan
    with threadpool_limits(1, "blas"):
        measurements = replace(measure(job.photos, whole), brightest=job.brightest)
        if known is not None:
            found = known
        elif has_correspondence_photos(plan):
            found = correspond_by_photos(job.photos, whole)
        else:
            found = by_phase(measurements, str(job.capture.path))
        transport = job.estimate(
            plan, measurements, found.q, progress or (lambda _share: None), job.device
        )
    provenance = provenance_of(job.capture, job.photos, method=job.method, square=False)
    provenance["excess_of_sums"] = measurements.excess_of_sums
    mine = of_rows(transport, core)
    provenance["rounding"] = rounding_over_noise(mine) if job.half else 0.0
    seen = Correspondence(found.q[core], found.confidence[core])
    mine = replace(
        in_half(mine) if job.half else mine,
        provenance=provenance,
        quality=_quality(job.capture, block, seen),
    )
    return Part(mine, seen)


def _quality(capture: Capture, block: slice, seen: Correspondence) -> Quality | None:
    """Look at the white photo for what is saturated: no pattern is brighter."""
    found = white_and_black(capture.plan)
    if found is None:
        return None
    (white,) = capture.read([found[0]], block)
    return Quality(seen.confidence, (white >= 1).any(axis=-1))


def of_all(before: Mapping[str, Any], provenance: Mapping[str, Any]) -> dict[str, Any]:
    """Return the provenance of blocks so far and of one more: the worst of what they tell."""
    worst = {
        name: max(before.get(name, 0.0), provenance[name], key=abs)
        for name in ("excess_of_sums", "rounding")
    }
    return {**provenance, **worst}


def rows_at_once(photos: Photos, method: Method, memory: int) -> int:
    """Tell how many rows of the camera may be worked at in so many bytes.

    Raises
    ------
    InputError
        If not even one fits.
    """
    estimator, camera = ESTIMATORS[method], photos.camera
    shared, pixel = estimator.bytes_of(photos.plan, photos.channels)
    shared += LIBRARIES + _bytes_of_references(photos.plan, camera.pixels * photos.channels)
    row = SLACK * pixel * camera.width
    # One more for correspondence by phase.
    beside = 2 * (estimator.halo + 1) if estimator.halo else 0
    rows = int((memory - shared) / row) - beside
    if rows + beside >= camera.height:
        return camera.height
    if rows < 1:
        least = shared + row * min(beside + 1, camera.height)
        raise InputError(
            f"{memory / 1e6:.0f} MB of memory are too few for one row of these photos: give "
            f"--memory {np.ceil(least / 1e8) / 10:.1f}GB or more."
        )
    return rows if rows < 2 * EVEN else rows - rows % EVEN


def _bytes_of_references(plan: Plan, values: int) -> int:
    """Bytes of the mean white and black of the whole camera, and of where they are saturated."""
    return 9 * values if plan.offset == "reference" else 0


def without_drift(photos: Photos, report: Progress) -> Photos:
    """Read photos by reference without the drift of lamp and ambient; others as they are."""
    if photos.plan.offset != "reference":
        return photos
    whites, blacks = find_references(photos.plan)
    total = 2 * (len(whites) + len(blacks))
    return remove_drift(photos, lambda done: report("references", done / total))


def brightest_white(photos: Photos) -> float:
    """Return the largest white less black of the whole camera."""
    found = white_and_black(photos.plan)
    if found is None:
        return 0.0
    row = 8 * photos.camera.width * photos.channels
    brightest = 0.0
    for rows in blocks(photos.camera.height, 2**26 // row):
        white, black = photos.read(list(found), rows)
        brightest = max(brightest, float((white - black).max()))
    return brightest


def by_phase(measurements: Measurements, source: str) -> Correspondence:
    """Find the correspondence in the photos of transport themselves.

    Raises
    ------
    InputError
        If the frequencies that were measured cannot settle it.
    """
    try:
        return correspond_by_phase(measurements)
    except InputError as error:
        reason = str(error).rstrip(".")
        raise InputError(f"{source}: {reason}, or give --correspondence Q.npy.") from None


def without_light(capture: Capture) -> InputError:
    """Say that there is no direct light."""
    return InputError(
        f"{capture.path} shows no direct light at any camera pixel: check that the camera "
        f"sees the projector's light, or give --correspondence Q.npy."
    )


def provenance_of(
    capture: Capture, photos: Photos, *, method: Method, square: bool
) -> dict[str, Any]:
    """Tell what a transport was made of."""
    plan = capture.plan
    drift = photos.drift if isinstance(photos, PhotosWithoutDrift) else None
    return {
        "nearfar": version(),
        "method": method,
        "square": square,
        "plan": {
            "window": plan.window,
            "far": list(plan.far),
            "dropped": list(plan.dropped),
            "offset": plan.offset,
            "photos": len(plan.patterns),
        },
        "photos": {"dtype": str(capture.photos.dtype), "full_scale": capture.full_scale},
        "rig": capture.rig,
        # Shares of the mean lamp and of white, where references tell.
        "drift": drift and {"lamp": drift.lamp_range, "ambient": drift.ambient_range},
    }


def unheard(_what: str, _share: float) -> None:
    """Take reports that nobody asked for."""
