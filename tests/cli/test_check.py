"""``nearfar check``: where the model holds, in lines, JSON and a page."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Job, check_done, check_sentence, run_nearfar

MODEL = ("--near", "5", "--far", "3x3")


def test_a_world_of_the_model_passes(finished: Job):
    found = json.loads(check_done(run_nearfar("check", finished.apart, *MODEL, "--json")).out)
    assert found["near_outside"] < 1e-6
    assert found["far_beyond"] < 1e-6
    assert found["checkerboard_near"] < 1e-3
    assert found["camera_pixels"] == 72
    assert sum(found["floodlit"].values()) == pytest.approx(1.0)
    assert found["condition"]["whole"] == pytest.approx(1.0)
    narrow = json.loads(
        check_done(
            run_nearfar("check", finished.apart, "--near", "3", "--far", "1x1", "--json")
        ).out
    )
    assert narrow["near_outside"] > 0.1
    assert narrow["far_beyond"] > 1e-3


def test_a_reconstruction_is_checked_too(finished: Job):
    said = check_done(run_nearfar("check", finished.transport, *MODEL)).out
    assert "F beyond k_far (a band of 3x3)" in said
    assert "condition of the near patterns over a whole window: 1.000" in said


def test_the_page_has_tables_and_maps(finished: Job, tmp_path: Path):
    page = tmp_path / "check.html"
    check_done(run_nearfar("check", finished.apart, *MODEL, "--report", page))
    text = page.read_text(encoding="utf-8")
    assert text.startswith("<!doctype html>")
    assert text.count("data:image/png;base64,") == 2
    assert "http" not in text
    assert '<p class="verdict good"><b>good.</b> The model with W = 5' in text
    for word in ("k_near", "checkerboard", "condition", "good, doubtful, wrong"):
        assert f"<td>{word}" in text or f"{word}</td>" in text
    check_sentence(run_nearfar("check", finished.apart, *MODEL, "--report", page), page, "--force")


def test_the_old_name_of_the_page_still_writes_it(finished: Job, tmp_path: Path):
    page = tmp_path / "check.html"
    ran = run_nearfar("check", finished.apart, *MODEL, "--html", page)
    assert ran.status == 0
    assert ran.err == (
        "warning: --html will be removed in the next release: write the page with --report.\n"
    )
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")
    both = run_nearfar("check", finished.apart, *MODEL, "--html", page, "--report", page)
    assert both.status == 2
    assert "--html" not in run_nearfar("check", "--help").out


def test_a_dense_transport_is_checked(finished: Job, tmp_path: Path):
    ran = check_done(run_nearfar("check", finished.truth, *MODEL))
    assert ran.out.splitlines()[-1].startswith("good: The model with W = 5 and a far band of 3x3")
    flat = tmp_path / "flat.npy"
    np.save(flat, np.load(finished.truth).reshape(72, 320, 3))
    check_sentence(run_nearfar("check", flat, *MODEL), flat, "--projector")
    sizes = ("--projector", "16x20", "--camera", "8x9")
    found = json.loads(check_done(run_nearfar("check", flat, *MODEL, *sizes, "--json")).out)
    assert found["verdict"] == "good"
    assert found["causes"] == [] or all(isinstance(cause, str) for cause in found["causes"])
    assert found["is_split_by_model"]


def test_what_cannot_be_checked(finished: Job, tmp_path: Path, folder_listing):
    page = tmp_path / "check.html"
    for arguments, words in (
        ((tmp_path / "none.zarr", *MODEL), ("none.zarr",)),
        ((finished.apart, "--near", "17", "--far", "3x3"), ("W = 17",)),
        ((finished.apart, "--near", "5", "--far", "3x21"), ("3x21",)),
        ((finished.apart, *MODEL, "--drop", "2x2"), ("--drop 2x2",)),
        ((finished.apart, *MODEL, "--drop", "5x5"), ("W = 5", "no near pattern")),
        ((finished.apart, "--near", "1", "--far", "3x3"), ("W = 1", "no near pattern")),
        ((finished.capture, *MODEL), (finished.capture,)),
    ):
        check_sentence(run_nearfar("check", *arguments, "--report", page), *words)
    assert folder_listing() == []
