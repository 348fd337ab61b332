"""What is said of a reconstruction, tile by tile and as a whole."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from nearfar.capture import Capture
from nearfar.photometry.drift_removal import PhotosWithoutDrift
from nearfar.photometry.photos import Photos
from nearfar.release import version
from nearfar.workflow.reconstruction.options import ReconstructionOptions

# Entries of the provenance of which the whole camera has the largest of its tiles.
LARGEST_OF_TILES = ("excess_of_sums", "rounding")


class Summary(NamedTuple):
    """What is said of rows of a transport that were reconstructed.

    Attributes
    ----------
    lit, pixels : int
        Camera pixels that are lit directly, and all; of a square T, its rows.
    provenance : mapping
        How they were made. ``excess_of_sums`` and ``rounding`` are the largest of all tiles.
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
    """Describe what a transport is made of, as JSON holds it."""
    plan = capture.plan
    drift = photos.drift if isinstance(photos, PhotosWithoutDrift) else None
    return {
        "nearfar": version(),
        "method": options.method,
        "square": options.square,
        "plan": {
            "window": plan.window,
            "far": list(plan.far),
            "dropped": list(plan.dropped),
            "offset": plan.offset,
            "photos": len(plan.patterns),
        },
        "photos": {"dtype": str(capture.photos.dtype), "full_scale": capture.full_scale},
        "rig": capture.rig,
        # Shares of the mean lamp and of white, as references show them.
        "drift": drift and {"lamp": drift.lamp_range, "ambient": drift.ambient_range},
    }
