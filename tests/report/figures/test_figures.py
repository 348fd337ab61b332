"""The paper's figures: drawn from measured data, kept, told apart by version, nothing clipped."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from nearfar.errors import ExistingOutputError, InputError, UnreadableFileError
from nearfar.files import read_picture
from nearfar.report.figures import NAMES, run
from nearfar.report.figures.run import make_figures
from nearfar.report.figures.sheets import SHEETS
from nearfar.report.figures.style import DPI, styled
from nearfar.workflow.experiments import acquired, in_theory
from nearfar.workflow.experiments import data as kept_data
from nearfar.workflow.experiments.data import Data, kept, read_data, together, write_data
from nearfar.workflow.experiments.paper import EXPERIMENTS
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.report.figures.conftest import WEDGE

ENDINGS = ("pdf", "png", "npz")


def test_the_cases_are_those_of_the_paper():
    found = {
        case: (plan.transport_photos, plan.savings)
        for case, plan in (
            ("box", acquired.BOX.plan),
            ("corner", acquired.CORNER.plan),
            ("wedge", in_theory.WEDGE.plan),
        )
    }
    assert found["box"] == (1060, pytest.approx(15.4566, abs=1e-4))
    assert found["corner"] == (788, pytest.approx(20.7919, abs=1e-4))
    assert found["wedge"] == (423, pytest.approx(16.0757, abs=1e-4))
    assert {name for sheet in SHEETS.values() for name in sheet.experiments} == set(EXPERIMENTS)
    assert set(NAMES) == {*SHEETS, "table"}


@pytest.mark.slow
def test_all_figures_stand_in_a_folder(drawn_once):
    out = drawn_once.folder
    assert sorted(path.name for path in out.iterdir()) == sorted(
        ["index.html", *(f"figure-{n}.{end}" for n in SHEETS for end in ENDINGS)]
    )
    page = (out / "index.html").read_text(encoding="utf-8")
    for name in SHEETS:
        assert (out / f"figure-{name}.pdf").read_bytes().startswith(b"%PDF")
        drawn = read_picture(out / f"figure-{name}.png")
        assert drawn.shape[1] == 1440
        assert drawn.std() > 10
        assert f"figure-{name}.png" in page
        data = read_data(out / f"figure-{name}.npz", f"figure {name}")
        assert data.arrays
        assert all(np.isfinite(values).all() for values in data.arrays.values())
    assert "as the paper states" in page
    assert "15.4" in page
    for word in ("nan", "None", "inf "):
        assert f">{word}<" not in page
    assert sorted(drawn_once.asked) == ["CLT", "box", "corner", "scan-line", "wedge"]


@pytest.mark.slow
def test_a_second_run_measures_nothing_and_draws_the_same(
    drawn_once, small, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    shutil.copytree(drawn_once.cache, tmp_path / "cache")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "0")
    make_figures(tmp_path / "two", ["2", "5"])
    assert small == []
    names = {path.name for path in (tmp_path / "two").iterdir()}
    assert names == {"index.html", *(f"figure-{n}.{e}" for n in "25" for e in ENDINGS)}
    for name in names:
        if name.endswith((".png", ".pdf")):
            one, two = (folder / name for folder in (drawn_once.folder, tmp_path / "two"))
            assert one.read_bytes() == two.read_bytes(), name
    # In whatever order the figures are asked for, and measured anew.
    monkeypatch.setenv("NEARFAR_CACHE", str(tmp_path / "empty"))
    monkeypatch.setattr(run, "save", lambda *_: None)
    make_figures(tmp_path / "three", ["5", "2"])
    assert sorted(small) == ["box", "wedge"]
    two, three = (tmp_path / folder / "index.html" for folder in ("two", "three"))
    assert two.read_bytes() == three.read_bytes()


def test_what_another_version_kept_is_measured_again_and_said(
    small, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    # What is kept is what was measured, whatever is drawn of it.
    monkeypatch.setattr(run, "save", lambda *_: None)
    notes: list[str] = []
    with monkeypatch.context() as older:
        older.setattr(kept_data, "version", lambda: "0.0.1")
        make_figures(tmp_path / "old", ["5"], note=notes.append)
    assert notes == []
    make_figures(tmp_path / "new", ["5"], note=notes.append)
    assert small == ["wedge", "wedge"]
    (note,) = notes
    assert "figures-wedge.npz" in note
    assert "0.0.1" in note
    assert note.endswith(".")
    make_figures(tmp_path / "newer", ["5"], note=notes.append)
    assert len(notes) == 1


@pytest.mark.parametrize(
    "spoil",
    [
        lambda path: path.write_bytes(b"no zip"),
        lambda path: path.write_bytes(path.read_bytes()[:-200]),
        lambda path: np.savez(path, T=np.ones(3)),
        lambda path: write_data(path, "corner", Data()),
    ],
    ids=["garbage", "cut short", "another archive", "another experiment"],
)
def test_a_damaged_cache_costs_its_time_and_no_more(small, tmp_path: Path, spoil):
    notes: list[str] = []
    make = lambda: Data({"values": np.arange(3.0)}, {"n": 1})  # noqa: E731
    kept("wedge", make, note=notes.append)
    path = tmp_path / "cache" / "figures-wedge.npz"
    spoil(path)
    again = kept("wedge", make, note=notes.append)
    assert len(notes) == 1
    assert str(path) in notes[0]
    np.testing.assert_array_equal(again.arrays["values"], np.arange(3.0))
    assert kept("wedge", lambda: pytest.fail("measured"), note=notes.append).numbers == {"n": 1}


def test_a_cache_that_cannot_be_written_costs_nothing(monkeypatch, tmp_path: Path):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("NEARFAR_CACHE", str(tmp_path / "file" / "cache"))
    notes: list[str] = []
    assert kept("wedge", lambda: Data({}, {"n": 2}), note=notes.append).numbers == {"n": 2}
    assert "not kept" in notes[0]


def test_data_are_what_was_written(tmp_path: Path):
    data = Data({"a/b": np.arange(6.0).reshape(2, 3)}, {"snr": [1.5, None]})
    write_data(tmp_path / "x.npz", "x", data)
    found = read_data(tmp_path / "x.npz", "x")
    assert found.numbers == data.numbers
    assert set(found.arrays) == set(data.arrays)
    np.testing.assert_array_equal(found.arrays["a/b"], data.arrays["a/b"])
    # Plain NumPy reads it, numbers and all, and nothing is unpickled.
    with np.load(tmp_path / "x.npz", allow_pickle=False) as plain:
        assert json.loads(str(plain["about"]))["numbers"]["snr"] == [1.5, None]
    with pytest.raises(UnreadableFileError):
        read_data(tmp_path / "x.npz", "y")
    assert together([data, Data({"c": np.ones(1)}, {"k": 1})]).numbers.keys() == {"snr", "k"}


@pytest.mark.slow
@pytest.mark.parametrize("name", list(SHEETS))
def test_no_label_is_clipped(drawn_once, measured_once, name: str):
    sheet = SHEETS[name]
    data = together([measured_once[one] for one in sheet.experiments])
    figure = drawn_once.figures[f"figure-{name}"]
    with styled():
        # Laid out as it was saved. Inches; what lies beyond the page would be cut off.
        figure.set_dpi(DPI)
        drawn = figure.get_tightbbox(FigureCanvasAgg(figure).get_renderer())
    texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    assert len(texts) >= 10
    assert drawn.x0 >= -0.01
    assert drawn.y0 >= -0.01
    assert drawn.x1 <= figure.get_figwidth() + 0.01
    assert drawn.y1 <= figure.get_figheight() + 0.01
    assert sheet.caption(data).endswith(".")


@pytest.mark.slow
def test_the_rival_has_as_many_patterns_and_its_own_lambda(measured_once):
    found = measured_once["CLT"].numbers["CLT"]
    assert found["patterns"] == WEDGE.plan.transport_photos
    best = max(max(plain, refitted) for _, plain, refitted in found["grid"])
    share, plain, refitted = next(line for line in found["grid"] if line[0] == found["share"])
    assert best == (refitted if found["refitted"] else plain)
    assert 0 < share <= 1
    ours = measured_once["wedge"].numbers["snr_b"]
    assert ours.keys() == found["snr_b"].keys() == {"white", "picture", "letters", "random"}
    for light, theirs in found["snr_b"].items():
        assert ours[light] > theirs + 10


def test_figures_that_are_not_there(tmp_path: Path, folder_listing):
    with pytest.raises(InputError, match="no figure '7'"):
        make_figures(tmp_path / "out", ["7"])
    said = check_sentence(run_nearfar("figures", tmp_path / "out", "--only", "seven"), "seven")
    assert "1, 2, 3, 4, 5, 6 or table" in said
    assert folder_listing() == []


@pytest.mark.parametrize("names", [("figure-9.png",), ("1.png", "2.png"), ("index.html",)])
def test_a_folder_of_someone_else_is_left_alone(small, tmp_path: Path, names):
    mine = tmp_path / "thesis"
    mine.mkdir()
    for name in names:
        (mine / name).write_text("mine")
    with pytest.raises(ExistingOutputError):
        make_figures(mine, ["5"], force=True)
    assert small == []
    assert sorted(path.name for path in mine.iterdir()) == sorted(names)


@pytest.mark.slow
def test_the_command_draws_one(small, tmp_path: Path):
    out = tmp_path / "out"
    said = check_done(run_nearfar("figures", out, "--only", "5")).out
    assert str(out / "index.html") in said
    check_sentence(run_nearfar("figures", out, "--only", "5"), out, "--force")
    check_done(run_nearfar("figures", out, "--only", "table", "--force"))
    assert [path.name for path in out.iterdir()] == ["index.html"]
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "condition of the near patterns" in page
