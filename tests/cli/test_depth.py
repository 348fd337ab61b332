"""``nearfar depth`` and ``nearfar calibrate --geometry``."""

import json

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.cli import calibrate_geometry
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.exact_store import save_exact
from nearfar.workflow.geometry.board import Board
from tests.absent import said_without
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.stereo.flat import BENT, board, exact_pixels, rig_of, rotation, sphere, transport_of

CAMERA, PROJECTOR = Size(36, 48), Size(36, 48)
STEREO = rig_of(CAMERA, PROJECTOR, bent=BENT)
MIDDLE, RADIUS = np.array([0.0, 0.0, 0.75]), 0.2
BALL = sphere(MIDDLE, RADIUS)


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    """A folder with the photos of a ball, its transport and the calibration; nobody writes here."""
    folder = tmp_path_factory.mktemp("ball")
    nearfar.save_stereo_calibration(STEREO, folder / "stereo.yml")
    save_exact(transport_of(STEREO, BALL, samples=4), folder / "ball.zarr")
    options = ("--photos", 60, "--projector", PROJECTOR, "-o", folder / "plan.json")
    check_done(run_nearfar("plan", *options))
    capture, rig = folder / "capture.zarr", ("--rig", folder / "ball.zarr")
    check_done(run_nearfar("acquire", folder / "plan.json", capture, *rig))
    check_done(run_nearfar("reconstruct", capture, folder / "transport.zarr"))
    return folder


def read_ply(path):
    """Read the vertices of a PLY by its own header."""
    header, _, body = path.read_bytes().partition(b"end_header\n")
    kinds = {"float": "<f4", "uchar": "u1"}
    lines = [line.split() for line in header.decode("ascii").splitlines()]
    assert lines[:2] == [["ply"], ["format", "binary_little_endian", "1.0"]]
    fields = [(line[2], kinds[line[1]]) for line in lines if line[0] == "property"]
    (count,) = [int(line[2]) for line in lines if line[:2] == ["element", "vertex"]]
    vertices = np.frombuffer(body, dtype=fields)
    assert len(vertices) == count
    return vertices


@pytest.mark.parametrize("source", ["capture.zarr", "transport.zarr"])
def test_a_ball_is_round_within_the_error_bars(ball, tmp_path, source):
    out = tmp_path / "ball.ply"
    ran = check_done(run_nearfar("depth", ball / source, out, "--calibration", ball / "stereo.yml"))
    vertices = read_ply(out)
    assert f"{len(vertices)} points of" in ran.out
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1)
    away = np.linalg.norm(points - MIDDLE, axis=1) - RADIUS
    assert np.median(np.abs(away)) < 0.003
    # Along the ray, of which the radius is a part.
    rays = points / np.linalg.norm(points, axis=1, keepdims=True)
    facing = np.abs(np.einsum("nx,nx->n", rays, (points - MIDDLE) / RADIUS))
    bar = vertices["standard_deviation"] * facing
    assert 0.6 < np.mean(np.abs(away) < bar) < 0.8
    assert (vertices["confidence"] > 0.5).all()
    assert vertices["red"].max() == 255


def test_the_array_is_that_of_python_and_json_is_alone(ball, tmp_path):
    out = tmp_path / "ball.npy"
    command = ("depth", ball / "capture.zarr", out, "--calibration", ball / "stereo.yml")
    ran = check_done(run_nearfar(*command, "--json", "--least-confidence", 0.6))
    capture = nearfar.open_capture(ball / "capture.zarr")
    found = nearfar.depth(capture, STEREO, least_confidence=0.6)
    np.testing.assert_array_equal(np.load(out), found.points.astype(np.float32))
    told = json.loads(ran.out)
    assert told == found.as_json()
    assert told["points"] + told["missed"] + told["behind"] + told["unsure"] == told["lit"]
    again = nearfar.depth(nearfar.load_transport(ball / "transport.zarr"), STEREO)
    both = np.isfinite(again.points) & np.isfinite(found.points)
    assert np.median(np.abs(again.points - found.points)[both]) < 1e-3


def test_every_bad_input_gets_a_sentence(ball, job, tmp_path):
    out, known = tmp_path / "out.ply", ("--calibration", ball / "stereo.yml")
    none = tmp_path / "none.yml"
    capture = ball / "capture.zarr"
    check_sentence(run_nearfar("depth", capture, tmp_path / "a.obj", *known), "a.obj", ".ply")
    check_sentence(run_nearfar("depth", capture, out, "--calibration", none), none)
    check_sentence(run_nearfar("depth", capture, out, "--calibration", ball / "plan.json"), "M1")
    check_sentence(run_nearfar("depth", none, out, *known), none)
    check_sentence(run_nearfar("depth", ball / "ball.zarr", out, *known), "exact transport")
    check_sentence(run_nearfar("depth", job.capture, out, *known), "8x9", "36x48")
    check_sentence(run_nearfar("depth", capture, out, *known, "--scale", 2), "--scale")
    assert run_nearfar("depth", capture, out, *known, "--colour", "direct").status == 2
    assert not out.exists()
    out.write_text("kept")
    check_sentence(run_nearfar("depth", capture, out, *known), "--force")
    assert out.read_text() == "kept"


def test_the_geometry_of_a_scene_is_written(tmp_path):
    out = tmp_path / "stereo.yml"
    check_done(run_nearfar("calibrate", "shelf", "--geometry", "--projector", "8x12", "-o", out))
    read = nearfar.read_stereo_calibration(out)
    assert (read.projector.size, read.camera.size) == (Size(8, 12), Size(16, 24))
    rig = tmp_path / "rig.toml"
    rig.write_text('[scene]\nname = "shelf"\ncamera = "10x10"\n')
    check_done(run_nearfar("calibrate", rig, "--geometry", "-o", out, "--force"))
    assert nearfar.read_stereo_calibration(out).camera.size == Size(10, 10)


@pytest.mark.parametrize(
    ("arguments", "status", "words"),
    [
        (("cornell", "--geometry", "-o", "x.yml"), 1, "shares the projector's pinhole"),
        (("cornell-aside", "--geometry"), 2, "name STEREO.yml"),
        (("rig.toml", "-o", "x.yml"), 2, "goes with --geometry"),
        (("rig.toml", "--captures"), 2, "goes with --geometry"),
        (("a.toml", "b.toml"), 2, "more than one rig"),
        (("a.toml", "--geometry", "-o", "x.yml"), 1, "a.toml is not there"),
        (("a.zarr", "--geometry", "--captures", "-o", "x.yml"), 1, "a.zarr"),
        (("a.zarr", "--geometry", "--captures", "--board", "2x2", "-o", "x.yml"), 1, "too small"),
        (("mine.toml", "--geometry", "-o", "x.yml"), 1, "does not tell where"),
        (("real.toml", "--geometry", "-o", "x.yml"), 1, "on a terminal"),
    ],
)
def test_wrong_uses_of_geometry_are_told(arguments, status, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text('[scene]\ntransport = "T.npy"\n')
    (tmp_path / "real.toml").write_text('[camera]\ndriver = "folder"\npath = "photos"\n')
    ran = run_nearfar("calibrate", *arguments)
    assert ran.status == status
    assert words in " ".join(ran.err.split())
    assert not (tmp_path / "x.yml").exists()


BOARD_RIG = rig_of(Size(120, 160), Size(64, 96), bent=None)
TURNS = [(20, -15, 0), (-22, 12, 10), (5, 25, -10)]


@pytest.mark.slow
def test_poses_are_photographed_as_long_as_asked_and_calibrate_again(tmp_path, monkeypatch):
    pytest.importorskip("cv2")
    middle = np.array([0.0, 0.0, 0.6])
    worlds = [transport_of(BOARD_RIG, board(rotation(*turns), middle)) for turns in TURNS]
    # A pose in which no board is seen is taken again.
    worlds.insert(1, transport_of(BOARD_RIG, sphere(middle, 0.2)))
    waiting, questions = iter(worlds), []

    class Table:
        """A rig before which somebody places one board after another."""

        def __init__(self):
            self.number = 0

        def __getattr__(self, name):
            return getattr(self.rig, name)

        def place(self, question):
            questions.append(question)
            world = next(waiting, None)
            if world is None:
                return "f"
            self.rig = SimulatedRig(
                world, "board", SimulatedProjector(), SimulatedCamera(), 1.0, len(questions)
            )
            return ""

    table, folder = Table(), tmp_path / "s.poses"
    poses = calibrate_geometry.shoot_poses(
        table, BOARD_RIG.projector.size, folder, Board(Size(4, 6), 0.03), table.place, quiet=True
    )
    assert len(poses) == len(TURNS)
    assert [int(question.split()[1].rstrip(":")) for question in questions] == [1, 2, 2, 3, 4]
    assert "calibrate by 3 poses" in questions[-1]
    captures = sorted(folder.iterdir())
    assert [path.name for path in captures] == [f"pose-{n}.zarr" for n in (1, 2, 3)]
    out = tmp_path / "s.yml"
    options = ("--board", "4x6", "--square", 0.03, "-o", out)
    ran = run_nearfar("calibrate", "--geometry", "--captures", *captures, *options)
    assert ran.status == 0
    assert "3 poses; reprojection error" in ran.out
    found = nearfar.read_stereo_calibration(out)
    assert found.error < 0.5
    assert found.projector.size == BOARD_RIG.projector.size
    assert found.camera.matrix[0, 0] == pytest.approx(256, rel=0.15)
    assert found.baseline == pytest.approx(BOARD_RIG.baseline, rel=0.15)
    # Distances of the board's corners are those that were measured, whatever the lens.
    pose = poses[0]
    points = nearfar.stereo.triangulate_pixels(
        found, pose.camera.astype(float), pose.projector.astype(float), np.ones(pose.camera.shape)
    ).points
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)
    places = np.linalg.norm(pose.places[:, None] - pose.places[None], axis=-1)
    far = places > 0.06
    assert np.median(apart[far] / places[far]) == pytest.approx(1, abs=0.02)
    two = ("--captures", *captures[:2], "--board", "4x6", "-o", tmp_path / "two.yml")
    check_sentence(run_nearfar("calibrate", "--geometry", *two), "2 poses")


def test_without_opencv_it_is_named():
    said = said_without(
        "cv2",
        "from nearfar.workflow.geometry.opencv import opencv\nopencv()",
    )
    assert "pip install 'nearfar[webcam]'" in said


def test_exact_pixels_are_those_of_the_ball():
    points, _ = exact_pixels(STEREO, BALL)
    seen = np.isfinite(points[..., 2])
    assert 0.3 < seen.mean() < 1
    np.testing.assert_allclose(np.linalg.norm(points[seen] - MIDDLE, axis=-1), RADIUS)
