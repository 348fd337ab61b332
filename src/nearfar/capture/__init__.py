"""Captures: raw photos on the disk, and photos taken elsewhere."""

from nearfar.capture.importing import ImportSummary, Pairing, import_photos, pair, pairing
from nearfar.capture.observing import CaptureObserver, Decision
from nearfar.capture.shown import ShownPictures, read_shown
from nearfar.capture.store import KIND, Capture, open_capture, white_and_black
from nearfar.capture.writing import CaptureWriter, write_capture

__all__ = [
    "KIND",
    "Capture",
    "CaptureObserver",
    "CaptureWriter",
    "Decision",
    "ImportSummary",
    "Pairing",
    "ShownPictures",
    "import_photos",
    "open_capture",
    "pair",
    "pairing",
    "read_shown",
    "white_and_black",
    "write_capture",
]
