"""Correspondence by photos of its own, whichever method a plan holds them for."""

from collections.abc import Callable

from nearfar.correspondence.methods import method_of
from nearfar.correspondence.result import Correspondence
from nearfar.photometry.measure import measure
from nearfar.photometry.photos import Photos
from nearfar.plan import CORRESPONDENCE_METHODS, Plan


def has_correspondence_photos(plan: Plan) -> bool:
    """Return whether a plan holds all photos of its own that a correspondence method needs."""
    return method_of(plan) is not CORRESPONDENCE_METHODS["phase"]


def correspond_by_photos(
    photos: Photos, rows: slice | None = None, progress: Callable[[int], None] | None = None
) -> Correspondence:
    """Find q(c) by the method of the photos' plan; see `nearfar.correspondence.methods.Find`."""
    rows = slice(0, photos.camera.height) if rows is None else rows
    return method_of(photos.plan).find(photos, rows, lambda: measure(photos, rows), progress)
