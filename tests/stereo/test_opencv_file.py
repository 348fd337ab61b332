"""STEREO.yml, as OpenCV writes and reads it, and bad ones."""

from dataclasses import replace

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from tests.stereo.flat import BENT, rig_of

STEREO = rig_of(Size(24, 32), Size(36, 48), bent=BENT)


def same(one, other):
    for name in ("camera", "projector"):
        a, b = getattr(one, name), getattr(other, name)
        assert a.size == b.size
        np.testing.assert_array_equal(a.matrix, b.matrix)
        np.testing.assert_array_equal(a.distortion, b.distortion)
    np.testing.assert_array_equal(one.rotation, other.rotation)
    np.testing.assert_array_equal(one.translation, other.translation)


def test_what_is_written_is_read(tmp_path):
    nearfar.save_stereo_calibration(STEREO, tmp_path / "s.yml")
    same(nearfar.read_stereo_calibration(tmp_path / "s.yml"), STEREO)
    assert nearfar.read_stereo_calibration(tmp_path / "s.yml").error is None
    with pytest.raises(nearfar.NearfarError, match="force=True"):
        nearfar.save_stereo_calibration(STEREO, tmp_path / "s.yml")


def test_the_reprojection_error_is_kept_if_it_is_a_number(tmp_path):
    path = tmp_path / "s.yml"
    nearfar.save_stereo_calibration(replace(STEREO, error=0.25), path)
    assert nearfar.read_stereo_calibration(path).error == 0.25
    path.write_text(path.read_text().replace("error: 0.25", f"error: {10**30}"))
    assert nearfar.read_stereo_calibration(path).error is None


def test_opencv_reads_what_is_written(tmp_path):
    cv2 = pytest.importorskip("cv2")
    nearfar.save_stereo_calibration(STEREO, tmp_path / "s.yml")
    storage = cv2.FileStorage(str(tmp_path / "s.yml"), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("M1").mat(), STEREO.camera.matrix)
    np.testing.assert_array_equal(storage.getNode("D2").mat().ravel(), BENT)
    np.testing.assert_array_equal(storage.getNode("T").mat()[:, 0], STEREO.translation)
    sizes = storage.getNode("size2")
    assert [sizes.at(i).real() for i in range(sizes.size())] == [48, 36]
    storage.release()


def test_what_opencv_writes_is_read(tmp_path):
    cv2 = pytest.importorskip("cv2")
    storage = cv2.FileStorage(str(tmp_path / "s.yml"), cv2.FILE_STORAGE_WRITE)
    # Without a point YAML takes 1e-05 for text.
    tiny = np.array([1e-5, 0, 0, 0, 0])
    for number, lens in enumerate((STEREO.camera, STEREO.projector), start=1):
        storage.write(f"M{number}", lens.matrix)
        storage.write(f"D{number}", tiny[None])
        storage.startWriteStruct(f"size{number}", cv2.FileNode_SEQ | cv2.FileNode_FLOW)
        storage.write("", lens.size.width)
        storage.write("", lens.size.height)
        storage.endWriteStruct()
    storage.write("R", STEREO.rotation)
    storage.write("T", STEREO.translation[:, None])
    storage.release()
    read = nearfar.read_stereo_calibration(tmp_path / "s.yml")
    np.testing.assert_array_equal(read.camera.distortion, tiny)
    np.testing.assert_array_equal(read.rotation, STEREO.rotation)
    assert read.projector.size == Size(36, 48)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("M2:", "M3:", "has no M2"),
        ("size1: [ 32, 24 ]", "size1: 32", "size1 of"),
        ("size1: [ 32, 24 ]", "size1: [ 32, 0 ]", "size1 of"),
        ("rows: 3\n   cols: 1", "rows: 1\n   cols: 4", "cannot be read|can be read"),
        ("R: !!opencv-matrix", "R: !!python/object:os.system", "can be read"),
        ("D1: !!opencv-matrix\n   rows: 1\n   cols: 4", "D1: [1, 2, 3]\nX:", "can be read|D1"),
        ("data: [ 51.2", "data: [ -51.2", "no camera matrix"),
        ("data: [ 51.2", "data: [ .nan", "M1"),
        ("---", "--- [", "can be read"),
    ],
)
def test_a_bad_file_gets_a_sentence(old, new, words, tmp_path):
    path = tmp_path / "s.yml"
    nearfar.save_stereo_calibration(STEREO, path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(nearfar.NearfarError, match=words) as seen:
        nearfar.read_stereo_calibration(path)
    assert str(path) in str(seen.value)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"rotation": 2 * np.eye(3)}, "no rotation"),
        ({"rotation": -np.eye(3)}, "no rotation"),
        ({"translation": np.zeros(3)}, "share a pinhole"),
        ({"translation": np.zeros(2)}, "T of"),
        ({"translation": [[1.0], [2.0, 3.0]]}, "T of"),
        ({"camera_distortion": [1.0, 2.0]}, "D1 of"),
        ({"camera_matrix": np.eye(2)}, "M1 of"),
    ],
)
def test_arrays_of_other_kinds_get_a_sentence(changed, words):
    given = {
        "camera": (8, 8),
        "camera_matrix": np.eye(3),
        "camera_distortion": None,
        "projector": (8, 8),
        "projector_matrix": np.eye(3),
        "projector_distortion": None,
        "rotation": np.eye(3),
        "translation": [1.0, 0, 0],
    }
    with pytest.raises(nearfar.NearfarError, match=words):
        nearfar.StereoCalibration.from_opencv(**{**given, **changed})


def test_a_short_file_does_not_stand_for_a_huge_matrix(tmp_path):
    path = tmp_path / "s.yml"
    nearfar.save_stereo_calibration(STEREO, path)
    text = path.read_text() + "a: &a [1, 1]\nb: [*a, *a]\n"
    path.write_text(text)
    with pytest.raises(nearfar.NearfarError, match="aliases"):
        nearfar.read_stereo_calibration(path)


def test_what_is_no_calibration_gets_a_sentence(tmp_path):
    for content in (b"", b"a b", b"[1, 2]", b"\xff\xfe\x00", b"&a [*a, *a]", b"[" * 5000):
        (tmp_path / "s.yml").write_bytes(content)
        with pytest.raises(nearfar.NearfarError, match=r"s\.yml"):
            nearfar.read_stereo_calibration(tmp_path / "s.yml")
    with pytest.raises(FileNotFoundError, match="is not there"):
        nearfar.read_stereo_calibration(tmp_path / "none.yml")
