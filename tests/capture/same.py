"""Whether two captures are the same."""

import numpy as np


def check_same(capture, other):
    assert capture.plan == other.plan
    assert capture.rig == other.rig
    assert capture.full_scale == other.full_scale
    np.testing.assert_array_equal(capture.photos[:], other.photos[:])
    np.testing.assert_array_equal(capture.saturated, other.saturated)
    assert (np.diff(capture.times) >= 0).all()
    folder = capture.path
    assert {path.name for path in folder.iterdir()} == {
        "photos",
        "saturated",
        "time",
        "zarr.json",
    }
    assert list(folder.parent.iterdir()) == [folder]
