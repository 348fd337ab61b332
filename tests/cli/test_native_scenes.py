"""Scenes whose matrices would be too large, from render to evaluate."""

import json

import pytest

from nearfar.files import kind_of_store
from nearfar.scenes import cache
from nearfar.scenes.native import sizes
from tests.cli.conftest import BY_PAPER, PLAN, check_done, check_sentence, run_nearfar

SIZES = ("--projector", "16x20", "--camera", "18x15")


@pytest.fixture
def operator(tmp_path, monkeypatch):
    """The corner as an operator, which any size is too large for matrices of here."""
    monkeypatch.setattr(cache, "LARGEST_MATRICES", 1)
    monkeypatch.setattr(sizes, "PATCHES_ALONG", 10)
    out = tmp_path / "operator.zarr"
    check_done(run_nearfar("render", "corner", out, *SIZES))
    return out


def test_an_operator_is_photographed_and_judged_by(operator, tmp_path):
    plan, capture, transport = (tmp_path / name for name in ("p.json", "c.zarr", "t.zarr"))
    assert kind_of_store(operator) == "nearfar exact operator"
    said = check_done(run_nearfar("info", operator)).out
    assert "corner, projector 16x20, camera 18x15, 3 channels, components apart" in said
    check_done(run_nearfar(*PLAN, "-o", plan))
    rig = tmp_path / "rig.toml"
    rig.write_text('[scene]\nname = "corner"\ncamera = "18x15"\n')
    check_done(run_nearfar("acquire", plan, tmp_path / "same.zarr", "--rig", rig))
    check_done(run_nearfar("acquire", plan, capture, "--rig", operator))
    check_done(run_nearfar("reconstruct", capture, transport, *BY_PAPER))
    page = tmp_path / "page.html"
    judged = run_nearfar(
        "evaluate", transport, "--truth", operator, "--json", "--report", page, "--quiet"
    )
    found = json.loads(judged.out)
    assert found["snr_b_pictures"] > 20
    assert found["pixels_without_light"] == 0
    assert set(found["snr"]) == {"T", "physical", "floodlit"}
    assert "ceiling" not in found
    text = page.read_text()
    assert "its rows, by physics" in text
    assert "its rows, by the model" not in text


def test_an_operator_where_a_transport_is_meant_names_what_it_is_good_for(operator, tmp_path):
    told = run_nearfar("view", operator, "--no-browser")
    check_sentence(told, f"nearfar acquire PLAN.json CAPTURE.zarr --rig {operator}")
    other = run_nearfar("compare", operator, tmp_path / "o")
    assert other.status == 0
    assert "Hadamard came to nothing" in other.err
    assert "is too large for a method that holds each entry of T" in other.err
