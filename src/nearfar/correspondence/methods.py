"""The interface of correspondence methods, and the choice of one for a plan."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from nearfar.correspondence.result import Correspondence
from nearfar.errors import InputError
from nearfar.photometry.measurements import Measurements
from nearfar.photometry.photos import Photos
from nearfar.plan import CORRESPONDENCE_METHODS, Plan
from nearfar.plan.correspondence import CorrespondencePatterns


class Find(Protocol):
    """Finds q in photos."""

    def __call__(
        self,
        photos: Photos,
        rows: slice,
        measure: Callable[[], Measurements],
        progress: Callable[[int], None] | None = None,
    ) -> Correspondence:
        """Find q(c) of some rows of the camera.

        Parameters
        ----------
        photos : Photos
        rows : slice
        measure : callable
            Returns the measurements of these rows; for methods that need them.
        progress : callable, optional
            Called with the number of photos for correspondence that are read.

        Returns
        -------
        Correspondence
            Of these rows.

        Raises
        ------
        InputError
            If the photos do not settle q.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class CorrespondenceMethod(CorrespondencePatterns):
    """A way to find q(c): the patterns that it adds to a plan, and what finds q in the photos.

    One of nearfar's own is a file in `nearfar.correspondence` and a line in
    `nearfar.plan.correspondence`; another package's is an entry point of the group
    ``nearfar.correspondences``.

    Attributes
    ----------
    serves : callable
        From a plan to whether it holds all that the method needs.
    find : callable
        Finds q in the photos of a plan that the method serves; see `Find`.
    rows_beside : int, or callable
        Rows of the camera on each side of some rows that q in them depends on; or, from a plan to
        this number.
    """

    serves: Callable[[Plan], bool]
    find: Find
    rows_beside: int | Callable[[Plan], int] = 0

    def rows_needed(self, plan: Plan) -> int:
        """Return the rows of the camera on each side of some rows that q in them depends on."""
        return self.rows_beside(plan) if callable(self.rows_beside) else self.rows_beside


def method_named(name: str) -> CorrespondenceMethod:
    """Return the correspondence method of a name.

    Raises
    ------
    InputError
        If there is none of that name, or it finds no q.
    ExtensionError
        If another package's method cannot be loaded.
    """
    method = CORRESPONDENCE_METHODS[name]
    if not isinstance(method, CorrespondenceMethod):
        raise InputError(
            f"the correspondence method {name!r} finds no correspondence: choose another one, or "
            f"give the correspondence."
        )
    return method


def method_of(plan: Plan) -> CorrespondenceMethod:
    """Return the correspondence method that finds q in the photos of a plan.

    It is the method that the plan names. Where the plan does not hold all that this method needs,
    since its capture ended early, say, it is the first of nearfar's methods that the plan serves.

    Raises
    ------
    ExtensionError
        If another package's method cannot be loaded.
    """
    for name in (plan.correspondence, *CORRESPONDENCE_METHODS.own):
        method = CORRESPONDENCE_METHODS[name]
        if isinstance(method, CorrespondenceMethod) and method.serves(plan):
            return method
    raise AssertionError("correspondence by phase serves every plan")


def find_correspondence(
    photos: Photos, measurements: Measurements, rows: slice | None = None
) -> Correspondence:
    """Find q(c) by the method of the photos' plan; see `method_of`.

    Parameters
    ----------
    photos : Photos
    measurements : Measurements
        What `nearfar.photometry.measure.measure` made of the same rows.
    rows : slice, optional
        Rows of the camera; all by default.

    Returns
    -------
    Correspondence

    Raises
    ------
    InputError
        If the photos do not settle q.
    """
    rows = slice(0, photos.camera.height) if rows is None else rows
    return method_of(photos.plan).find(photos, rows, lambda: measurements)
