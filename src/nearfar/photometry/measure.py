"""From the photos of a plan to measurements, by inverse pairs, by reference or by codes."""

from collections.abc import Callable

from nearfar.arrays import Floats
from nearfar.illumination.frequencies import Frequency
from nearfar.illumination.real_basis import RealBasis
from nearfar.photometry.by_codes import measure_by_codes, weighing_of
from nearfar.photometry.by_inverse import find_pairs, measure_pairs, responses_of_pairs
from nearfar.photometry.by_reference import measure_by_reference, responses_by_reference
from nearfar.photometry.drift import find_references
from nearfar.photometry.drift_removal import PhotosWithoutDrift, remove_drift
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import Photos, find_waves
from nearfar.plan import Plan


def measured_frequencies(plan: Plan) -> set[Frequency]:
    """Return the frequencies that the photos of a plan measure.

    Raises
    ------
    PlanError
        If the plan's patterns are complex, or somebody else's pictures.
    InputError
        If a pattern lacks its inverse, or a plan by reference its whites and blacks.
    """
    plan.require_real("measure")
    plan.require_sinusoids("measure")
    if plan.is_by_codes:
        return set(weighing_of(plan).basis.frequencies)
    if plan.offset == "reference":
        find_references(plan)
        return {frequency for frequency, _ in find_waves(plan)}
    return {pair.frequency for pair in find_pairs(plan)}


def measured_basis(plan: Plan) -> tuple[RealBasis, Floats]:
    """Return the basis that the photos of a plan measure, and how often, without any photo.

    Returns
    -------
    basis : RealBasis
        That of the measurements.
    multiplicity : ndarray, shape (R,)
        How often each response is measured.

    Raises
    ------
    PlanError, InputError
        As `measure`.
    """
    plan.require_real("measure")
    plan.require_sinusoids("measure")
    if plan.is_by_codes:
        weighing = weighing_of(plan)
        return weighing.basis, weighing.multiplicity
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
        A capture. The drift of one by reference is removed first, from the whole camera: to
        measure such a capture in tiles of rows, give what `remove_drift` returned.
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
        If the plan's patterns are complex, or somebody else's pictures.
    InputError
        If a pattern lacks its inverse, or a plan by reference its whites and blacks.
    """
    photos.plan.require_real("measure")
    photos.plan.require_sinusoids("measure")
    rows = slice(0, photos.camera.height) if rows is None else rows
    if photos.plan.offset == "reference":
        without_drift = photos if isinstance(photos, PhotosWithoutDrift) else remove_drift(photos)
        if photos.plan.is_by_codes:
            return measure_by_codes(without_drift, rows, progress)
        return measure_by_reference(without_drift, rows, progress)
    return measure_pairs(photos, rows, progress)
