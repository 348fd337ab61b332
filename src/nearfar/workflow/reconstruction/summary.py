"""Summaries of a reconstruction: of each tile and of the whole camera."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from nearfar.capture import Capture
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.photometry.photos import Photos
from nearfar.release import version
from nearfar.workflow.reconstruction.options import ReconstructionOptions

# Entries of the provenance that are, for the whole camera, the largest of its tiles.
LARGEST_OF_TILES = ("excess_of_sums", "rounding")


class Summary(NamedTuple):
    """Camera pixels and provenance of some rows of a reconstructed transport.

    Attributes
    ----------
    lit, pixels : int
        Camera pixels with direct light, and all camera pixels; of a square T, rows of T.
    provenance : mapping
        How the rows were reconstructed. ``excess_of_sums`` and ``rounding`` are the largest of all
        tiles.
    """

    lit: int = 0
    pixels: int = 0
    provenance: Mapping[str, Any] = {}

    def with_tile(self, tile: "Summary") -> "Summary":
        """Return the summary of these rows and of one more tile."""
        largest = {
            name: max(self.provenance.get(name, 0.0), tile.provenance[name], key=abs)
            for name in LARGEST_OF_TILES
        }
        provenance = {**tile.provenance, **largest}
        return Summary(self.lit + tile.lit, self.pixels + tile.pixels, provenance)


def provenance_of(
    capture: Capture, photos: Photos, options: ReconstructionOptions
) -> dict[str, Any]:
    """Return the provenance of a transport as JSON types: options, plan, photos, rig and drift."""
    drift = photos.drift if isinstance(photos, PhotosWithoutDrift) else None
    return {
        "nearfar": version(),
        "method": options.method,
        "square": options.square,
        **description_of(capture),
        # Shares of the mean lamp and of white, as references show them.
        "drift": drift and {"lamp": drift.lamp_range, "ambient": drift.ambient_range},
    }


def description_of(capture: Capture) -> dict[str, Any]:
    """Return the part of a transport's provenance that identifies its capture: plan, photos, rig.

    ``taken`` is when the last photo was taken, in seconds since the epoch.
    """
    plan = capture.plan
    return {
        "plan": {
            "window": plan.window,
            # Left out at 1, as before there was a pitch, so that captures are known again.
            **({} if plan.pitch == 1 else {"pitch": plan.pitch}),
            "far": list(plan.far),
            "dropped": list(plan.dropped),
            "offset": plan.offset,
            "photos": len(plan.patterns),
        },
        "photos": {
            "dtype": str(capture.photos.dtype),
            "full_scale": capture.full_scale,
            "taken": float(capture.times.max()),
        },
        "rig": capture.rig,
    }
