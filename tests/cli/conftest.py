"""The command line in this process, and a small job that is done once."""

import contextlib
import io
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from scipy import sparse

from nearfar.arrays import Size
from nearfar.cli.application import main
from nearfar.transport.exact import ExactTransport
from nearfar.transport.exact_store import save_exact
from tests.worlds import model_transport

Untouched = Callable[[], bool]

PROJECTOR = "16x20"
GRID = ("--projector", PROJECTOR)
# The worlds of these tests obey the paper's model, which its own estimator recovers exactly.
BY_PAPER = ("--method", "paper")
PLAN = ("plan", "--projector", PROJECTOR, "--near", "5", "--far", "3x3")


class Ran(NamedTuple):
    """What a command left: exit status, stdout, stderr."""

    status: int
    out: str
    err: str


def run_nearfar(*arguments: object) -> Ran:
    """Run a command in this process."""
    out, err = io.StringIO(), io.StringIO()
    argv, sys.argv = sys.argv, ["nearfar", *map(str, arguments)]
    status = 0
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            main()
    except SystemExit as stopped:
        status = int(stopped.code or 0)
    finally:
        sys.argv = argv
    return Ran(status, out.getvalue(), err.getvalue())


def check_done(ran: Ran) -> Ran:
    """Assert that a command did its work without a word on stderr."""
    assert ran.err == ""
    assert ran.status == 0
    return ran


def check_sentence(ran: Ran, *names: object) -> str:
    """Assert that a command failed with status 1 and one sentence that names things."""
    assert ran.status == 1, ran
    assert ran.out == ""
    assert ran.err.startswith("nearfar: ")
    assert ran.err.endswith(".\n")
    sentence = ran.err.removeprefix("nearfar: ").removesuffix("\n")
    assert "\n" not in sentence
    assert "Traceback" not in sentence
    assert "fault of its own" not in sentence
    for name in names:
        assert str(name) in sentence
    return sentence


class Job(NamedTuple):
    """Files of a job that went well."""

    folder: Path
    plan: Path
    patterns: Path
    photos: Path
    truth: Path
    apart: Path
    capture: Path
    transport: Path
    light: Path


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Job:
    """Do a small job once; nobody writes here."""
    folder = tmp_path_factory.mktemp("job")
    job = Job(
        folder,
        folder / "plan.json",
        folder / "patterns",
        folder / "photos",
        folder / "truth.npy",
        folder / "apart.zarr",
        folder / "capture.zarr",
        folder / "transport.zarr",
        folder / "light.npy",
    )
    world = model_transport(
        Size(16, 20), Size(8, 9), window=5, far=Size(3, 3), channels=3, entries=3
    )
    dense = np.moveaxis(world.dense(), 1, 2).reshape(8, 9, 16, 20, 3)
    np.save(job.truth, dense)
    d, n, f = (np.moveaxis(part, 1, 0) for part in world.component_rows(slice(None)))
    thin = [tuple(sparse.csr_array(channel) for channel in part) for part in (d, n)]
    exact = ExactTransport(world.projector, world.camera, *thin, np.ascontiguousarray(f))
    save_exact(exact, job.apart)
    np.save(job.light, np.random.default_rng(1).uniform(size=(16, 20)).astype(np.float32))
    check_done(run_nearfar(*PLAN, "-o", job.plan))
    check_done(run_nearfar("export", job.plan, job.patterns))
    check_done(run_nearfar("acquire", job.plan, job.capture, "--rig", job.truth))
    check_done(run_nearfar("reconstruct", job.capture, job.transport, *BY_PAPER))
    photograph(job.patterns, job.photos, dense[..., 0])
    return job


def photograph(
    patterns: Path, photos: Path, dense: np.ndarray, *, dtype: str = "uint16", ambient: float = 0.02
) -> None:
    """Take .npy photos of exported patterns: ambient + T l, T as (Cy, Cx, Py, Px[, channels])."""
    import imagecodecs

    photos.mkdir()
    for path in sorted(patterns.glob("pattern-*.png")):
        light = imagecodecs.png_decode(path.read_bytes()).astype(np.float64) / 255
        picture = ambient + np.einsum("yxpq...,pq->yx...", dense, light)
        np.save(
            photos / f"{path.stem}.npy",
            np.rint(picture * np.iinfo(dtype).max).astype(dtype),
        )


@pytest.fixture
def job(finished: Job, tmp_path: Path) -> Job:
    """Give a copy of the small job to spoil, in the test's own folder."""
    copy = tmp_path / "job"
    shutil.copytree(finished.folder, copy)
    return Job(copy, *(copy / path.name for path in finished[1:]))


@pytest.fixture
def shot(finished: Job, tmp_path: Path) -> Callable[..., Path]:
    """Photograph the patterns of `separate`, black last, on one channel of the small world."""

    def shoot(*options: object, black_level: float = 0.0, ambient: float = 0.02) -> Path:
        patterns, photos = tmp_path / "patterns", tmp_path / "photos"
        check_done(run_nearfar("separate", patterns, "--export", *GRID, *options))
        dense = np.load(finished.truth)[..., 0]
        photograph(patterns, photos, dense, ambient=ambient)
        floodlit = dense.sum(axis=(2, 3)) * black_level / (1 - black_level)
        for photo in photos.iterdir():
            np.save(photo, np.load(photo) + np.rint(65535 * floodlit).astype(np.uint16))
        return photos

    return shoot


@pytest.fixture
def untouched(tmp_path: Path) -> Untouched:
    """Tell whether the test's folder is byte for byte as when first asked."""
    seen: list[dict[str, bytes | None]] = []

    def ask() -> bool:
        seen.append(
            {
                str(path.relative_to(tmp_path)): path.read_bytes() if path.is_file() else None
                for path in tmp_path.rglob("*")
            }
        )
        return seen[0] == seen[-1]

    return ask


def check_refused(untouched: Untouched, arguments: tuple[object, ...], *names: object) -> str:
    """Assert that a command fails in a sentence that names things, and touches nothing."""
    untouched()
    sentence = check_sentence(run_nearfar(*arguments), *names)
    assert untouched(), "something was left behind or changed"
    return sentence
