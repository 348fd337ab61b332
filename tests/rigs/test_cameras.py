"""Camera drivers: libgphoto2's own virtual camera, video files, folders that photos drop into."""

import sys
import threading
import time
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.errors import DeviceError, InputError, LostPhotoError
from nearfar.files import encode_png
from nearfar.rigs.cameras.folder import FolderCamera
from nearfar.rigs.cameras.gphoto import seconds_of
from nearfar.rigs.cameras.registry import find_cameras
from nearfar.rigs.cameras.webcam import OpencvCamera
from tests.absent import said_without
from tests.files.test_raw import dng
from tests.rigs.displays import run_on

DSLR = """
import os, sys
from pathlib import Path
folder, jpegs = Path(sys.argv[1]), [Path(p).read_bytes() for p in sys.argv[2:]]
os.environ["VCAMERADIR"] = str(folder)
import gphoto2
# The wheel brings the port driver of a virtual camera, which is not among the usual ones.
os.environ["IOLIBS"] = os.environ["IOLIBS"].replace("iolibs", "vusb")
import numpy as np
from nearfar.errors import NearfarError
from nearfar.rigs.cameras import gphoto
found = gphoto.find()
print(found)
settings = {"shutterspeed": "0.0500s", "f-number": "f/5.6"}
with gphoto.GphotoCamera(found[0].device, settings=settings) as camera:
    assert camera.name == "Nikon DSC D750", camera.name
    told = {n: camera._widget(n).get_value() for n in ("shutterspeed", "f-number")}
    assert told == settings, told
    low, high = camera.exposure_limits
    assert 0 < low < 0.01 <= 1.0 <= high
    assert camera.set_exposure(0.09) == 0.1
    assert camera._widget("shutterspeed").get_value() == "0.1000s"
    for number, jpeg in enumerate(jpegs):
        (folder / "photo.jpg").write_bytes(jpeg)
        photo = camera.photograph()
        np.save(folder.parent / f"taken{number}.npy", photo)
    assert camera.full_scale == 255 and not camera.linear
    (folder / "photo.jpg").write_bytes(b"x" * len(jpegs[0]))
    try:
        camera.take()
    except NearfarError as error:
        print(error)
for wrong in ({"iso": "100"}, {"f-number": "f/99"}):
    try:
        gphoto.GphotoCamera(settings=wrong)
    except NearfarError as error:
        print(error)
"""


def test_a_dslr_is_set_released_and_its_photo_brought_over(tmp_path):
    folder = tmp_path / "card"
    folder.mkdir()
    generator = np.random.default_rng(0)
    pictures = [generator.integers(0, 256, (48, 64, 3), dtype=np.uint8) for _ in range(2)]
    encoded = [imagecodecs.jpeg8_encode(p, level=95) for p in pictures]
    size = max(map(len, encoded)) + 16
    paths = []
    for i, jpeg in enumerate(encoded):
        paths.append(tmp_path / f"{i}.jpeg")
        # The virtual card takes files of one size only.
        paths[-1].write_bytes(jpeg + b"\0" * (size - len(jpeg)))
    (folder / "photo.jpg").write_bytes(paths[0].read_bytes())
    done = run_on("", "-c", DSLR, folder, *paths)
    assert done.returncode == 0, done.stderr
    assert "Nikon DSC D750" in done.stdout
    assert "JPG is no picture that can be read" in done.stdout
    assert "no setting iso" in done.stdout
    assert "no f-number 'f/99'" in done.stdout
    for i, jpeg in enumerate(encoded):
        taken = np.load(tmp_path / f"taken{i}.npy")
        np.testing.assert_array_equal(taken, imagecodecs.jpeg8_decode(jpeg))


@pytest.mark.parametrize(
    ("choice", "seconds"),
    [
        ("1/250", 1 / 250), ("0.0040s", 0.004), ("2.5", 2.5), ("10/25", 0.4), ("30", 30.0),
        ("Bulb", None), ("Auto", None), ("0", None), ("1/0", None), ("", None),
    ],
)  # fmt: skip
def test_exposures_as_cameras_write_them(choice, seconds):
    assert seconds_of(choice) == seconds


@pytest.fixture
def video(tmp_path):
    """Frames of a camera that runs by itself."""
    cv2 = pytest.importorskip("cv2")
    frames = np.random.default_rng(1).integers(0, 256, (12, 32, 48, 3), dtype=np.uint8)
    path = tmp_path / "video.avi"
    code = cv2.VideoWriter_fourcc(*"FFV1")
    writer = cv2.VideoWriter(str(path), code, 30.0, (48, 32))
    for frame in frames:
        writer.write(frame[..., ::-1])
    writer.release()
    return path, frames


def test_a_webcams_queue_is_skipped(video):
    path, frames = video
    with OpencvCamera(str(path), skip=3) as camera:
        assert camera.exposure_limits is None
        np.testing.assert_array_equal(camera.photograph(), frames[3])
        np.testing.assert_array_equal(camera.photograph(), frames[7])
        with pytest.raises(InputError, match="cannot be set from here"):
            camera.set_exposure(0.1)
        camera.photograph()
        with pytest.raises(LostPhotoError, match="no more frames"):
            camera.photograph()


def test_a_webcam_that_is_not_there_is_named(video):
    with pytest.raises(DeviceError, match=r"/dev/video99 cannot be opened"):
        OpencvCamera("/dev/video99")
    with pytest.raises(InputError, match="no property SHINE"):
        OpencvCamera(str(video[0]), properties={"SHINE": 1})
    with pytest.raises(InputError, match="gives 32x48, not 10x10"):
        OpencvCamera(str(video[0]), size=Size(10, 10))


def _later(path, data, *, parts=1, after=0.1):
    """Write a file as a camera does: after a while, and in parts."""

    def write():
        time.sleep(after)
        with path.open("wb") as file:
            for part in np.array_split(np.frombuffer(data, np.uint8), parts):
                file.write(part.tobytes())
                file.flush()
                time.sleep(0.06)

    thread = threading.Thread(target=write)
    thread.start()
    return thread


def test_photos_that_drop_into_a_folder(tmp_path):
    picture = np.random.default_rng(2).integers(0, 65536, (20, 30, 3)).astype(np.uint16)
    (tmp_path / "old.png").write_bytes(encode_png(picture[::-1]))
    with FolderCamera(tmp_path, patience=20) as camera:
        thread = _later(tmp_path / "IMG_1.png", encode_png(picture), parts=6)
        np.testing.assert_array_equal(camera.photograph(), picture)
        thread.join()
        assert camera.full_scale == 65535
        mosaic = np.random.default_rng(0).integers(600, 15000, (48, 64)).astype(np.uint16)
        thread = _later(tmp_path / "IMG_2.DNG", dng(mosaic), parts=3)
        assert camera.photograph().shape == (24, 32, 3)
        thread.join()


def test_a_command_releases_the_shutter(tmp_path):
    picture = np.random.default_rng(3).integers(0, 256, (20, 30), dtype=np.uint8)
    folder, source = tmp_path / "a folder", tmp_path / "source.png"
    folder.mkdir()
    source.write_bytes(encode_png(picture))
    script = tmp_path / "release.py"
    script.write_text(
        "import sys, shutil, pathlib\n"
        "folder = pathlib.Path(sys.argv[1])\n"
        f"shutil.copy({str(source)!r}, folder / f'{{len(list(folder.iterdir()))}}.png')\n"
    )
    command = f"{sys.executable} '{script}' {{}}"
    with FolderCamera(folder, command=command, frames=3) as camera:
        photo = camera.photograph()
        np.testing.assert_array_equal(photo[..., 0], np.where(picture == 255, 255.0, picture))
        assert len(list(folder.iterdir())) == 3


@pytest.mark.parametrize(
    ("command", "fault", "words"),
    [
        (None, LostPhotoError, "no photo came into"),
        ("no-such-command", DeviceError, r"no-such-command cannot be run \(No such file"),
        (
            "'{python}' -c 'import sys; sys.exit(\"no film\")'",
            LostPhotoError,
            r"status 1 \(no film\)",
        ),
        ("'{python}' -c 'import time; time.sleep(9)'", LostPhotoError, "did not end"),
        ("'unclosed", InputError, "cannot be read"),
    ],
)
def test_a_folder_that_stays_empty_is_named(tmp_path, command, fault, words):
    given = command and command.replace("{python}", sys.executable)
    with (
        pytest.raises(fault, match=words),
        FolderCamera(tmp_path, command=given, patience=0.5) as camera,
    ):
        camera.photograph()


def test_two_files_for_one_pattern_are_refused(tmp_path):
    data = encode_png(np.zeros((4, 4), np.uint8))
    with FolderCamera(tmp_path, patience=5) as camera:
        (tmp_path / "0.png").write_bytes(data)
        before = camera._files()
        for name in ("1.png", "2.png"):
            (tmp_path / name).write_bytes(data)
        with pytest.raises(DeviceError, match="2 photos came into"):
            camera._next(before)
    (tmp_path / "b").mkdir()
    with FolderCamera(tmp_path / "b", patience=5) as camera:
        _later(tmp_path / "b" / "IMG_1.png", data).join()
        camera._used.add("IMG_1")
        with pytest.raises(DeviceError, match="second file of a photo"):
            camera._next(set())
    with pytest.raises(DeviceError, match="no folder to watch"):
        FolderCamera(Path(tmp_path / "none"))


def test_what_cannot_be_looked_for_says_why():
    found, unable = find_cameras()
    assert all(camera.device for camera in found)
    assert all("install" in sentence for sentence in unable)


@pytest.mark.parametrize(
    ("package", "module", "extra"),
    [("gphoto2", "gphoto", "gphoto2"), ("cv2", "webcam", "webcam")],
)
def test_without_their_packages_there_is_a_sentence(package, module, extra):
    said = said_without(package, f"from nearfar.rigs.cameras import {module}\n{module}.find()")
    assert f"pip install 'nearfar[{extra}]'" in said


def test_without_aravis_there_is_a_sentence():
    program = (
        "from nearfar.rigs.cameras import aravis_library\n"
        "aravis_library.NAMES = {'linux': ('libno.so', 'libno.so', 'libno.so')}\n"
        "aravis_library.aravis()"
    )
    assert "apt install libaravis-0.8-0" in said_without("nothing", program)


def test_without_harvesters_there_is_a_sentence(tmp_path):
    program = (
        "from pathlib import Path\nfrom nearfar.rigs.cameras.genicam import HarvestersCamera\n"
        "HarvestersCamera(Path('maker.cti'))"
    )
    assert "pip install 'nearfar[genicam]'" in said_without("harvesters", program)
