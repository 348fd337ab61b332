"""From the photos of a plan to measurements, whatever takes the offset out."""

from collections.abc import Callable

from nearfar.arrays import Floats
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.real_basis import RealBasis
from nearfar.photometry.by_inverse import find_pairs, measure_pairs, responses_of_pairs
from nearfar.photometry.by_reference import measure_by_reference, responses_by_reference
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import PhotosWithoutDrift, remove_drift
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import Photos, find_shown
from nearfar.plan import Plan


def measured_frequencies(plan: Plan) -> set[Frequency]:
    """Tell which frequencies the photos of a plan measure.

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If a pattern lacks its inverse, or a plan by reference its whites and blacks.
    """
    plan.require_real("measure")
    if plan.offset == "reference":
        find_references(plan)
        return {frequency for frequency, _ in find_shown(plan)}
    return {pair.frequency for pair in find_pairs(plan)}


def answered(plan: Plan) -> tuple[RealBasis, Floats]:
    """Tell what the photos of a plan measure before there are any.

    Returns
    -------
    basis : RealBasis
        That of the measurements.
    multiplicity : ndarray, shape (R,)
        How often each answer is measured.

    Raises
    ------
    PlanError, InputError
        As `measure`.
    """
    plan.require_real("measure")
    if plan.offset == "reference":
        basis, _, multiplicity = responses_by_reference(plan)
    else:
        basis, _, multiplicity = responses_of_pairs(plan)
    return basis, multiplicity


def measure(
    photos: Photos, rows: slice | None = None, progress: Callable[[int], None] | None = None
) -> Measurements:
    """Turn photos into measurements.

    Parameters
    ----------
    photos : Photos
        A capture; one by reference is made `steady` first, so to measure it in blocks of rows
        make it steady once and give that.
    rows : slice, optional
        Rows of the camera to measure; all by default.
    progress : callable, optional
        Called with the number of photos read so far.

    Returns
    -------
    Measurements
        In photo units. A pattern that was shot several times counts as the mean.

    Raises
    ------
    PlanError
        If the plan's patterns are complex.
    InputError
        If a pattern lacks its inverse, or a plan by reference its whites and blacks.
    """
    photos.plan.require_real("measure")
    rows = slice(0, photos.camera.height) if rows is None else rows
    if photos.plan.offset == "reference":
        followed = photos if isinstance(photos, PhotosWithoutDrift) else remove_drift(photos)
        return measure_by_reference(followed, rows, progress)
    return measure_pairs(photos, rows, progress)
