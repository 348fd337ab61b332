"""The steps from a capture to a transport as single functions: measure, correspond, estimate.

`nearfar.reconstruct` performs all steps tile by tile of the camera, in bounded memory. Here each
step processes the whole camera at once, and returns the input of the next.
"""

from dataclasses import replace

from nearfar.arrays import AnySize, as_size
from nearfar.capture import Capture
from nearfar.checks import as_count, require_instance
from nearfar.correspondence import (
    Correspondence,
    method_named,
    method_of,
)
from nearfar.devices import Device
from nearfar.errors import InputError
from nearfar.estimate.base import ESTIMATORS, Model
from nearfar.illumination.frequencies import default_dropped
from nearfar.parallel import single_threaded_products
from nearfar.photometry.measure import measure as measure_photos
from nearfar.photometry.measurements import Measurements
from nearfar.plan.window import largest_window
from nearfar.progress import Report, counting, ignore_progress
from nearfar.transport.model import Transport
from nearfar.workflow.by_codes import correspond_by_codes
from nearfar.workflow.reconstruction.sources import brightest_white, photos_without_drift


def measure(capture: Capture, *, progress: Report | None = None) -> Measurements:
    """Turn the photos of a capture into responses to cosines and sines (section 4.1).

    Drift of the lamp and of ambient light is removed where the plan shows references.

    Parameters
    ----------
    capture : Capture
    progress : callable, optional
        Called with the step and the share of it that is done, 0 to 1.

    Returns
    -------
    Measurements
        Of the whole camera, in photo units.

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If a pattern lacks its inverse, or the plan has too few references.

    Examples
    --------
    >>> measurements = nearfar.measure(capture)
    >>> measurements.responses.shape  # camera pixels, channels, cosines and sines
    (64, 1, 18)
    """
    require_instance(capture, Capture, "capture", "nearfar.open_capture")
    report = progress or ignore_progress
    photos = photos_without_drift(capture, report)
    count = len(capture.plan.patterns)
    with single_threaded_products():
        found = measure_photos(photos, progress=counting(report, "measuring", count))
    return replace(found, brightest=brightest_white(photos))


def correspond(
    capture: Capture,
    *,
    method: str | None = None,
    measurements: Measurements | None = None,
    progress: Report | None = None,
) -> Correspondence:
    """Find the projector pixel that lights each camera pixel directly (section 5.1).

    Parameters
    ----------
    capture : Capture
    method : str, optional
        "stripes", "gray" or "phase": from photos of stripes, from photos of Gray code, or from the
        phase of the photos of transport; or a method that another package adds. By default the
        plan's own; of pictures that are somebody else's, by what each projector pixel shows.
    measurements : Measurements, optional
        Of the capture, for the phase; by default the capture is measured here.
    progress : callable, optional
        Called with the step and the share of it that is done, 0 to 1.

    Returns
    -------
    Correspondence
        At the camera's resolution; NaN where no direct light is seen, and in an axis that no
        pattern tells.

    Raises
    ------
    InputError
        If the capture does not have the photos that the method needs.

    Examples
    --------
    >>> correspondence = nearfar.correspond(capture)
    >>> int(correspondence.lit.sum())
    64
    """
    require_instance(capture, Capture, "capture", "nearfar.open_capture")
    report, plan = progress or ignore_progress, capture.plan
    if plan.offset == "shown" and method is None:
        return correspond_by_codes(capture, report).correspondence
    chosen = method_of(plan) if method is None else method_named(method)
    photos = photos_without_drift(capture, report)
    count = max(1, plan.counts["correspondence"])
    with single_threaded_products():
        return chosen.find(
            photos,
            slice(0, photos.camera.height),
            lambda: measurements or measure(capture, progress=report),
            counting(report, "correspondence", count),
        )


def estimate_transport(
    measurements: Measurements,
    correspondence: Correspondence,
    window: int,
    far: AnySize,
    *,
    pitch: int = 1,
    method: str = "joint",
    dropped: AnySize | None = None,
    device: Device = "cpu",
    progress: Report | None = None,
) -> Transport:
    """Estimate direct, near- and far-range transport from measurements and correspondence.

    Parameters
    ----------
    measurements : Measurements
    correspondence : Correspondence
    window : int
        W: near-range light comes from a window of W x W functions around q.
    far : Size or (height, width)
        Far band, in DFT frequencies of the pattern grid.
    pitch : int
        Projector pixels between the functions of the window, a power of two: 1, the default, for a
        window of single pixels.
    method : str
        Estimator: ``"joint"`` estimates all three components in one model, ``"paper"`` one after
        another as in the paper; or an estimator that another package adds.
    dropped : Size or (height, width), optional
        Block of near frequencies that were not measured, for the paper's estimator; by default
        that of `nearfar.paper_plan`.
    device : {"cpu", "cuda", "torch"}
        Device of the estimate: NumPy, PyTorch on an accelerator, or PyTorch on the processor.
    progress : callable, optional
        Called with the step and the share of it that is done, 0 to 1.

    Returns
    -------
    Transport

    Raises
    ------
    InputError
        If the estimator needs frequencies that were not measured, no camera pixel has direct
        light, or the device is not there.

    Examples
    --------
    >>> estimate = nearfar.estimate_transport(measurements, correspondence, 3, (3, 3))
    >>> estimate
    <nearfar transport: projector 8x8, camera 8x8, channels 1, W = 3>
    """
    require_instance(measurements, Measurements, "measurements", "nearfar.measure")
    require_instance(correspondence, Correspondence, "correspondence", "nearfar.correspond")
    report, far = progress or ignore_progress, as_size(far, "far")
    window, projector = as_count(window, "window", 1), measurements.projector
    pitch = as_count(pitch, "pitch", 1)
    if pitch & (pitch - 1):
        raise InputError(f"a pitch of {pitch} is no power of two: choose 1, 2, 4 or a larger one.")
    if (
        window > largest_window(projector, pitch)
        or far.height > projector.height
        or far.width > projector.width
    ):
        raise InputError(
            f"W = {window} and a far band of {far} do not fit a projector of {projector}: choose "
            f"smaller ones."
        )
    if not correspondence.lit.any():
        raise InputError(
            "the correspondence has no camera pixel with direct light, so there is nothing to "
            "estimate: check that the camera sees the projector's light."
        )

    def done(share: float) -> None:
        report("estimating", share)

    left_out = (
        default_dropped(window, far, measurements.projector)
        if dropped is None
        else as_size(dropped, "dropped")
    )
    estimator, model = ESTIMATORS[method], Model(window, far, left_out, pitch)
    with single_threaded_products():
        return estimator.estimate(
            measurements, correspondence.q, model, device=device, progress=done
        )
