"""Old ways to call public functions keep working, and warn."""

from inspect import signature

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from tests.worlds import model_transport

SIZE = Size(6, 6)


def photos_of(more):
    return {"photos": more[0]} if more else {}


def test_a_path_that_comes_first_is_still_taken(tmp_path):
    transport = model_transport(SIZE, SIZE, window=3, far=Size(1, 1))
    exact = nearfar.ExactTransport(SIZE, SIZE, (), (), np.ones((1, 36, 36), np.float32))
    plan = nearfar.paper_plan(SIZE, 1, Size(1, 1), correspondence="none")
    photos = [plan.draw(i) for i in range(len(plan.patterns))]
    calls = {
        "save_transport": (transport,),
        "save_exact": (exact,),
        "write_capture": (plan, photos),
    }
    for name, (what, *more) in calls.items():
        function, path = getattr(nearfar, name), tmp_path / f"{name}.zarr"
        with pytest.warns(DeprecationWarning, match=f"{name} with the path as its first") as seen:
            function(path, what, *more)
        assert seen[0].filename == __file__
        content = next(iter(signature(function).parameters))
        with pytest.warns(DeprecationWarning, match=f"{name} with the path as its first"):
            function(path, *more[1:], **{content: what}, **photos_of(more), force=True)
        function(what, str(path), *more, force=True)
    assert nearfar.load_transport(tmp_path / "save_transport.zarr").camera == SIZE


def test_a_callback_of_one_argument_is_still_called_with_counts(tmp_path):
    plan = nearfar.paper_plan(SIZE, 1, (1, 1), correspondence="none")
    photos = [plan.draw(i) for i in range(len(plan.patterns))]
    built_in, written = [], []

    def note(done):
        written.append(done)

    for number, progress in enumerate((built_in.append, note)):
        with pytest.warns(DeprecationWarning, match="callback of one argument") as seen:
            nearfar.write_capture(plan, tmp_path / f"{number}.zarr", photos, progress=progress)
        assert seen[0].filename == __file__
    assert built_in == written == list(range(1, len(photos) + 1))


def test_counted_is_taken_wherever_progress_is(tmp_path):
    plan = nearfar.paper_plan(SIZE, 1, (1, 1), correspondence="none")
    photos = [plan.draw(i) for i in range(len(plan.patterns))]
    told = []
    with pytest.warns(DeprecationWarning, match=r"nearfar\.counted"):
        counted = nearfar.counted
    progress = counted(lambda what, share: told.append((what, share)), "shots", len(photos))
    nearfar.write_capture(plan, tmp_path / "a.zarr", photos, progress=progress)
    assert told[-1] == ("photos", 1.0)
    progress(len(photos))
    assert told[-1] == ("shots", 1.0)
