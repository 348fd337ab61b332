"""Captures that were stopped and resumed: as if they had never been stopped."""

import errno
import json
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import CaptureWriter, open_capture, white_and_black, write_capture
from nearfar.capture.unfinished import LOG_NAME
from nearfar.errors import (
    ExistingOutputError,
    InputError,
    KeptInterrupt,
    MissingFileError,
    StorageError,
    UnreadableFileError,
    UselessPhotosError,
)
from nearfar.files import output, stores
from nearfar.plan import choose_plan
from nearfar.plan.checks import with_checks
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.workflow.acquire import acquire
from tests.capture.same import check_same
from tests.metadata import change_attributes
from tests.observers import EndsWhere
from tests.worlds import model_transport

PROJECTOR = Size(16, 20)
PLAN = choose_plan(PROJECTOR, 50, window=5)[0]
COUNT = len(PLAN.patterns)


@pytest.fixture(scope="module")
def rig():
    world = model_transport(PROJECTOR, Size(8, 9), window=5, far=Size(3, 3), channels=2)
    return SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 1.0, 3)


@pytest.fixture(scope="module")
def undisturbed(rig, tmp_path_factory):
    return acquire(PLAN, tmp_path_factory.mktemp("whole") / "c.zarr", rig)


def _stop_after(count, reason=KeyboardInterrupt):
    def stop(number, _photo):
        if number + 1 == count:
            raise reason

    return EndsWhere(stop)


def _stopped(rig, path, count, plan=PLAN, resume=False):
    with pytest.raises(KeptInterrupt, match=f"^interrupted; {count} of {COUNT} photos are kept"):
        acquire(plan, path, rig, observers=[_stop_after(count)], resume=resume)


def _counting(told):
    """Return a progress callback that lists how many photos were there after each."""
    return lambda _what, share: told.append(round(share * COUNT))


@pytest.mark.parametrize("stops", [(2,), (15,), (16,), (17, 18, 40), (COUNT - 1,), (COUNT,)])
def test_it_is_as_if_it_had_not_been_stopped(rig, undisturbed, tmp_path, stops):
    for i, stop in enumerate(stops):
        _stopped(rig, tmp_path / "c.zarr", stop, resume=i > 0)
        assert [path.name for path in tmp_path.iterdir()] == ["c.zarr.unfinished"]
    told = []
    capture = acquire(PLAN, tmp_path / "c.zarr", rig, resume=True, progress=_counting(told))
    # No photo was taken twice.
    assert told == list(range(stops[-1] + 1, COUNT + 1))
    check_same(capture, undisturbed)


class _Odd:
    """A rig with which something happens instead of a photo."""

    def __init__(self, rig, at, what):
        self._rig, self._at, self._what = rig, at, what

    def __getattr__(self, name):
        return getattr(self._rig, name)

    def shoot(self, patterns, first=0):
        for number, photo in enumerate(self._rig.shoot(patterns, first), first):
            if number != self._at:
                yield photo
            elif isinstance(self._what, BaseException):
                raise self._what
            else:
                yield self._what(photo)


def test_what_was_stopped_before_the_second_photo_leaves_nothing(rig, tmp_path):
    for stop in (0, 1):
        with pytest.raises(KeyboardInterrupt) as stopped:
            acquire(PLAN, tmp_path / "c.zarr", _Odd(rig, stop, KeyboardInterrupt()))
        assert not isinstance(stopped.value, KeptInterrupt)
        assert list(tmp_path.iterdir()) == []


def test_a_photo_that_was_not_noted_is_taken_again(rig, undisturbed, tmp_path):
    _stopped(rig, tmp_path / "c.zarr", 20)
    log = tmp_path / "c.zarr.unfinished" / LOG_NAME
    log.write_bytes(log.read_bytes()[:-7])
    told = []
    capture = acquire(PLAN, tmp_path / "c.zarr", rig, resume=True, progress=_counting(told))
    assert told[0] == 20
    check_same(capture, undisturbed)


def test_every_photo_is_told_to_who_decides(rig, tmp_path):
    heard = []
    _stopped(rig, tmp_path / "c.zarr", 10)

    def hear(number, photo):
        heard.append((number, photo.shape))
        return number == 29

    capture = acquire(PLAN, tmp_path / "c.zarr", rig, resume=True, observers=[EndsWhere(hear)])
    assert heard == [(number, (8, 9, 2)) for number in range(30)]
    assert len(capture.plan.patterns) == 30


def test_a_capture_does_not_end_before_the_photos_that_are_there(rig, tmp_path):
    # What says now that 20 photos are enough may say so of 20, not of the 25 there are.
    _stopped(rig, tmp_path / "c.zarr", 25)
    ends = {20, 40}
    capture = acquire(
        PLAN,
        tmp_path / "c.zarr",
        rig,
        resume=True,
        observers=[EndsWhere(lambda n, _photo: n + 1 in ends)],
    )
    assert len(capture.plan.patterns) == 40
    _stopped(rig, tmp_path / "d.zarr", 25)
    capture = acquire(
        PLAN,
        tmp_path / "d.zarr",
        rig,
        resume=True,
        observers=[EndsWhere(lambda n, _photo: n + 1 == 25)],
    )
    assert len(capture.plan.patterns) == 25


@pytest.mark.parametrize(
    ("odd", "word"),
    [
        (lambda photo: np.full_like(photo, 16383), "much brighter"),
        (lambda photo: photo[:-1], "same camera settings"),
    ],
)
def test_an_odd_photo_is_named_and_taken_again(rig, undisturbed, tmp_path, odd, word):
    with pytest.raises(InputError, match=rf"photo 40 .*{word}.*; 40 of {COUNT} photos are kept"):
        acquire(PLAN, tmp_path / "c.zarr", _Odd(rig, 40, odd))
    check_same(acquire(PLAN, tmp_path / "c.zarr", rig, resume=True), undisturbed)


def test_a_rig_that_ends_too_soon_keeps_its_photos(rig, undisturbed, tmp_path):
    class Short(_Odd):
        def shoot(self, patterns, first=0):
            return islice(self._rig.shoot(patterns, first), 30)

    with pytest.raises(InputError, match=f"only 30 photos for the {COUNT} .*; 30 of .* are kept"):
        acquire(PLAN, tmp_path / "c.zarr", Short(rig, 0, None))
    check_same(acquire(PLAN, tmp_path / "c.zarr", rig, resume=True), undisturbed)


def test_a_dark_projector_keeps_nothing(rig, tmp_path):
    white, _ = white_and_black(PLAN)
    with pytest.raises(UselessPhotosError, match="no brighter"):
        acquire(PLAN, tmp_path / "c.zarr", _Odd(rig, white, np.zeros_like))
    assert list(tmp_path.iterdir()) == []


def test_a_capture_that_replaces_another_is_gone_on_with(rig, undisturbed, tmp_path):
    first = acquire(PLAN, tmp_path / "c.zarr", replace(rig, seed=9))
    before = first.photos[:]
    with pytest.raises(KeptInterrupt, match="`resume=True, force=True` goes on"):
        acquire(PLAN, tmp_path / "c.zarr", rig, observers=[_stop_after(20)], force=True)
    np.testing.assert_array_equal(open_capture(tmp_path / "c.zarr").photos[:], before)
    with pytest.raises(ExistingOutputError, match="`force=True`"):
        acquire(PLAN, tmp_path / "c.zarr", rig, resume=True)
    told = []
    acquire(PLAN, tmp_path / "c.zarr", rig, resume=True, force=True, progress=_counting(told))
    assert told[0] == 21
    check_same(open_capture(tmp_path / "c.zarr"), undisturbed)


def test_the_same_plan_with_other_options_is_named(rig, tmp_path):
    checked = with_checks(PLAN)
    for before, now, word in (
        (PLAN, checked, r"leave out `with_checks\(plan\)`"),
        (checked, PLAN, r"give `with_checks\(plan\)`"),
    ):
        path = tmp_path / f"{len(before.patterns)}.zarr"
        with pytest.raises(KeptInterrupt):
            acquire(before, path, rig, observers=[_stop_after(12)])
        with pytest.raises(InputError, match=word):
            acquire(now, path, rig, resume=True)


def test_a_link_is_followed_and_the_folder_named(rig, tmp_path):
    (tmp_path / "else").mkdir()
    link, real = tmp_path / "link.zarr", tmp_path / "else" / "real.zarr"
    link.symlink_to(real)
    with pytest.raises(KeptInterrupt, match=str(tmp_path / "else" / "real.zarr.unfinished")):
        acquire(PLAN, link, rig, observers=[_stop_after(12)])
    capture = acquire(PLAN, link, rig, resume=True)
    assert real.is_dir()
    assert not (real / LOG_NAME).exists()
    assert len(capture.plan.patterns) == COUNT


@pytest.mark.parametrize("early", [None, 30])
def test_what_was_whole_but_for_its_name_is_not_shot_again(
    rig, undisturbed, tmp_path, monkeypatch, early
):
    def gone(*_arguments, **_options):
        raise KeyboardInterrupt

    def enough(number, _photo):
        return number + 1 == early

    with monkeypatch.context() as patch, pytest.raises(KeptInterrupt):
        patch.setattr(output, "move_into_place", gone)
        acquire(PLAN, tmp_path / "c.zarr", rig, observers=[EndsWhere(enough)])
    told = []
    capture = acquire(PLAN, tmp_path / "c.zarr", rig, resume=True, progress=_counting(told))
    assert told == []
    if early is None:
        check_same(capture, undisturbed)
    else:
        assert capture.plan == PLAN.first(early)
        np.testing.assert_array_equal(capture.photos[:], undisturbed.photos[:early])


def test_a_full_disk_costs_no_photo(rig, undisturbed, tmp_path, monkeypatch):
    write = stores._write_durably

    def full(path, value):
        if path.name == "c.25.0.0.0":
            raise OSError(errno.ENOSPC, "No space left on device")
        write(path, value)

    with monkeypatch.context() as patch:
        patch.setattr(stores, "_write_durably", full)
        with pytest.raises(StorageError, match=r"disk is full.*; 25 of .* are kept.*`resume=True`"):
            acquire(PLAN, tmp_path / "c.zarr", rig)
    check_same(acquire(PLAN, tmp_path / "c.zarr", rig, resume=True), undisturbed)


def test_a_capture_that_an_earlier_nearfar_began_is_gone_on_with(rig, undisturbed, tmp_path):
    earlier = PLAN.model_copy(update={"expected_snr": None})
    _stopped(rig, tmp_path / "c.zarr", 20, earlier)
    kept = json.loads(earlier.to_json()) | {"version": 5}
    assert kept.pop("expected_snr") is None
    change_attributes(tmp_path / "c.zarr.unfinished", plan=kept)
    told = []
    capture = acquire(earlier, tmp_path / "c.zarr", rig, resume=True, progress=_counting(told))
    assert told[0] >= 20
    np.testing.assert_array_equal(capture.photos[:], undisturbed.photos[:])


def test_another_plan_or_rig_is_refused_and_nothing_is_lost(rig, undisturbed, tmp_path):
    _stopped(rig, tmp_path / "c.zarr", 12)
    other = choose_plan(PROJECTOR, 40, window=5)[0]
    with pytest.raises(InputError, match="another plan"):
        acquire(other, tmp_path / "c.zarr", rig, resume=True)
    for changed in (replace(rig, seed=4), replace(rig, exposure=0.9)):
        with pytest.raises(InputError, match=r"another rig \((seed|transport_exposure)\)"):
            acquire(PLAN, tmp_path / "c.zarr", changed, resume=True)
    check_same(acquire(PLAN, tmp_path / "c.zarr", rig, resume=True), undisturbed)


def test_another_full_scale_is_refused(rig, undisturbed, tmp_path):
    _stopped(rig, tmp_path / "c.zarr", 12)
    folder = tmp_path / "c.zarr.unfinished"
    about = json.loads((folder / "zarr.json").read_text())["attributes"]["rig"]
    said = f"with a full scale of {rig.full_scale:g}, and is to be resumed with 4095"
    with pytest.raises(InputError, match=said):
        CaptureWriter.resume(folder, PLAN, full_scale=4095, rig=about)
    assert CaptureWriter.resume(folder, PLAN, rig=about).taken == 12
    check_same(acquire(PLAN, tmp_path / "c.zarr", rig, resume=True), undisturbed)


def test_what_is_there_is_replaced_by_force_alone(rig, undisturbed, tmp_path):
    _stopped(rig, tmp_path / "c.zarr", 12)
    with pytest.raises(
        ExistingOutputError, match=r"c\.zarr\.unfinished.*`resume=True`.*`force=True`"
    ):
        acquire(PLAN, tmp_path / "c.zarr", rig)
    told = []
    capture = acquire(PLAN, tmp_path / "c.zarr", rig, force=True, progress=_counting(told))
    assert told[0] == 1
    check_same(capture, undisturbed)
    with pytest.raises(MissingFileError, match="nothing to go on with"):
        acquire(PLAN, tmp_path / "d.zarr", rig, resume=True)


def test_what_is_not_finished_is_no_capture_yet(rig, tmp_path):
    _stopped(rig, tmp_path / "c.zarr", 12)
    with pytest.raises(UnreadableFileError, match=r"not finished.*`acquire.resume=True.`"):
        open_capture(tmp_path / "c.zarr.unfinished")


def test_two_at_once_are_refused(rig, undisturbed, tmp_path):
    path = tmp_path / "c.zarr"
    _stopped(rig, path, 12)
    refused = []

    def also(number, _photo):
        for options in ({"resume": True}, {"force": True}, {"resume": True, "force": True}):
            with pytest.raises(ExistingOutputError, match="another nearfar is at work"):
                acquire(PLAN, path, rig, **options)
        with pytest.raises(ExistingOutputError, match="`resume=True`"):
            acquire(PLAN, path, rig)
        refused.append(number)
        return False

    check_same(acquire(PLAN, path, rig, resume=True, observers=[EndsWhere(also)]), undisturbed)
    assert len(refused) == COUNT


@pytest.mark.parametrize("damage", ["photos", "photo", "attributes", "more"])
def test_what_is_damaged_gets_a_sentence_and_is_left(rig, tmp_path, damage):
    _stopped(rig, tmp_path / "c.zarr", 12)
    folder = tmp_path / "c.zarr.unfinished"
    if damage == "photos":
        (folder / "photos" / "zarr.json").unlink()
    elif damage == "photo":
        (folder / "photos" / "c.0.0.0.0").write_bytes(b"torn")
    elif damage == "attributes":
        change_attributes(folder, full_scale="much")
    else:
        log = (folder / LOG_NAME).read_bytes()
        (folder / LOG_NAME).write_bytes(log * COUNT)
    with pytest.raises(UnreadableFileError, match=r"c\.zarr\.unfinished is damaged"):
        acquire(PLAN, tmp_path / "c.zarr", rig, resume=True)
    assert folder.is_dir()


def test_a_torn_line_does_not_spoil_the_next(rig, undisturbed, tmp_path):
    path = tmp_path / "c.zarr"
    log = tmp_path / "c.zarr.unfinished" / LOG_NAME
    for photos in (20, 40):
        with pytest.raises(KeptInterrupt):
            acquire(PLAN, path, rig, observers=[_stop_after(photos)], resume=log.exists())
        log.write_bytes(log.read_bytes()[:-5])
    # What was noted after the torn line is still known: one photo is taken again, not twenty.
    taken = []
    acquire(PLAN, path, rig, resume=True, progress=_counting(taken))
    assert taken[0] > 39
    check_same(open_capture(path), undisturbed)


@pytest.mark.parametrize("options", [{}, {"resume": True}])
def test_what_somebody_else_keeps_under_the_name_is_left(rig, tmp_path, options):
    folder = tmp_path / "c.zarr.unfinished"
    folder.mkdir()
    (folder / "precious.txt").write_text("mine")
    (folder / "photos.txt").write_text("mine")
    with pytest.raises(ExistingOutputError, match=r"c\.zarr\.unfinished"):
        acquire(PLAN, tmp_path / "c.zarr", rig, **options)
    with pytest.raises(ExistingOutputError, match="nothing that this command has left"):
        acquire(PLAN, tmp_path / "c.zarr", rig, force=True)
    assert sorted(path.name for path in folder.iterdir()) == ["photos.txt", "precious.txt"]


def test_observers_all_hear_of_every_photo_and_any_of_them_ends_the_capture(rig, tmp_path):
    heard = []

    class Hears:
        def after_photo(self, number, _photo):
            heard.append(number)

    at_20, at_30 = (EndsWhere(lambda number, _photo, n=n: number + 1 == n) for n in (20, 30))
    capture = acquire(PLAN, tmp_path / "c.zarr", rig, observers=[at_30, at_20, Hears()])
    assert len(capture.plan.patterns) == 20
    assert heard == list(range(20))


def test_a_predicate_and_told_of_before_still_work_and_warn(rig, tmp_path):
    def enough(number, _photo):
        return number + 1 == 20

    told, counts = [], []
    dark = replace(rig, exposure=3 * rig.exposure)
    old = {"enough": enough, "told": told.append, "progress": counts.append}
    with (
        pytest.warns(DeprecationWarning, match=r"enough of nearfar\.acquire") as predicate,
        pytest.warns(DeprecationWarning, match=r"told of nearfar\.acquire"),
        pytest.warns(DeprecationWarning, match="progress callback of one argument") as counted,
    ):
        capture = acquire(PLAN, tmp_path / "c.zarr", dark, **old)
    assert counts == list(range(1, 21))
    assert counted[0].filename == __file__
    assert predicate[0].filename == __file__
    assert len(capture.plan.patterns) == 20
    assert tuple(told) == capture.alarms
    photos = capture.photos[:]
    with pytest.warns(DeprecationWarning, match=r"enough of nearfar\.write_capture"):
        again = write_capture(
            PLAN, tmp_path / "d.zarr", photos, full_scale=capture.full_scale, enough=enough
        )
    np.testing.assert_array_equal(again.photos[:], photos)
