"""Accuracy on the exact scenes from noisy photos, by the command line, as users would see it."""

import json
from pathlib import Path

import pytest

from nearfar.arrays import parse_size
from nearfar.cli.application import main
from nearfar.scenes import sizes
from nearfar.scenes.cache import _path
from nearfar.transport.store import load_transport
from nearfar.workflow.experiments.in_theory import WEDGE, acquire_in_theory

# Scene, projector, W, far band; least SNR_b over five pictures and under white, dB. Camera: 30 000
# e- full well, read noise 4 e-, 14 bits, ambient 1 %, white at 90 % of the range: the defaults.
CASES = [
    ("cornell-aside", "64x64", 11, "7x7", 40.2, 48.0),
    ("wedge", "68x100", 19, "7x11", 45.5, 48.0),
]

pytestmark = pytest.mark.slow(minutes=4)


def _run(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> None:
    monkeypatch.setattr("sys.argv", ["nearfar", *map(str, arguments)])
    try:
        main()
    except SystemExit as end:
        assert not end.code, arguments


@pytest.mark.parametrize(("scene", "projector", "window", "far", "pictures", "white"), CASES)
def test_a_scene_is_relit_as_well_as_asked(
    tmp_path: Path, monkeypatch, capsys, scene, projector, window, far, pictures, white
):
    plan, capture, found = (tmp_path / name for name in ("plan.json", "c.zarr", "t.zarr"))
    _run(monkeypatch, "plan", "--projector", projector, "--near", window, "--far", far, "-o", plan)
    _run(monkeypatch, "acquire", plan, capture, "--rig", scene)
    _run(monkeypatch, "reconstruct", capture, found, "--method", "paper")
    # What render would write again: a gigabyte.
    truth = _path(scene, *sizes(scene, parse_size(projector)))
    capsys.readouterr()
    _run(monkeypatch, "evaluate", found, "--truth", truth, "--json")
    _check_accuracy(json.loads(capsys.readouterr().out), pictures, white)


def _check_accuracy(judged, pictures, white):
    assert judged["snr_b_pictures"] >= pictures
    assert judged["snr_b"]["white"] >= white
    # No camera pixel or frequency fails unseen behind the means.
    assert judged["snr_t"]["p5"] > 20
    assert judged["snr_b_frequency"]["p5"] > 30


def test_without_noise_every_frequency_and_camera_pixel_is_as_good_as_in_the_paper():
    found = acquire_in_theory(WEDGE, lambda _what, _share: None).numbers
    assert found["plan"]["transport_photos"] == 423
    # The paper's figure 5, dB.
    assert found["snr_b_frequency"]["p0"] >= 25
    assert found["snr_t"]["p0"] >= 25
    # The far band is measured itself; its neighbours are where near and far meet.
    ky, kx = found["lowest_frequency"]
    assert max(abs(ky) / 3.5, abs(kx) / 5) < 2


def test_the_demo_ends_in_a_page_and_is_as_accurate(tmp_path: Path, monkeypatch, capsys):
    _run(monkeypatch, "demo", tmp_path / "out")
    said = capsys.readouterr().out
    text = (tmp_path / "out" / "report.html").read_text()
    assert str(tmp_path / "out" / "report.html") in said
    # Three lights by seven pictures, and four maps, all inside the page.
    assert text.count("data:image/png;base64,") == 3 * 7 + 4
    assert "http" not in text
    assert "nan dB" not in text
    judged = json.loads((tmp_path / "out" / "numbers.json").read_text())
    assert f"{judged['snr_b_pictures']:.1f} dB" in text
    assert "117</b><span>photos in all" in text
    assert "35.0×</b><span>fewer than 4096" in text
    _check_accuracy(judged, 40.3, 48.0)
    kept = load_transport(tmp_path / "out" / "transport.zarr").verdict
    assert kept is not None
    assert kept.grade == "good"
    # The verdict leads.
    verdict = f'<p class="verdict good"><b>good.</b> {kept.summary}</p>'
    assert text.index("<h1>") < text.index(verdict) < text.index('class="fact')
    assert min(judged["physical_split"].values()) > 20
    assert f"{judged['physical_split']['interreflection']:.1f} dB" in text
    assert text.index("those of the physical split") < text.index("The model's split")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert names == {"plan.json", "capture.zarr", "transport.zarr", "report.html", "numbers.json"}
