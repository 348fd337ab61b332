"""Correspondence by photos of its own, whichever a plan holds."""

from collections.abc import Callable

from nearfar.correspondence.gray import correspond_by_gray_code, has_gray_code
from nearfar.correspondence.result import Correspondence
from nearfar.correspondence.stripes import correspond_by_stripes, has_stripes
from nearfar.photometry.photos import Photos
from nearfar.plan import Plan


def has_correspondence_photos(plan: Plan) -> bool:
    """Tell whether a plan holds stripes or Gray code on both axes."""
    return has_stripes(plan) or has_gray_code(plan)


def correspond_by_photos(
    photos: Photos, rows: slice | None = None, progress: Callable[[int], None] | None = None
) -> Correspondence:
    """Find q(c) from photos of stripes or, without them, of Gray code.

    Parameters and errors are those of `correspond_by_gray_code`.
    """
    if has_stripes(photos.plan):
        return correspond_by_stripes(photos, rows, progress)
    return correspond_by_gray_code(photos, rows, progress)
