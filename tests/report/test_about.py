"""What pages say of themselves: date, version, command line, and methods to cite."""

import html
import re
import shlex
import subprocess
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.plan import choose_plan, paper_plan
from nearfar.release import version
from nearfar.report.about import PAPER, software_reference, time_of_page
from nearfar.report.methods import checked_by_photos, comparison_methods, reconstruction_methods
from nearfar.report.page import page
from nearfar.transport.model import Transport
from nearfar.workflow.comparison import Comparison, Trial
from tests.cli.conftest import run_nearfar
from tests.worlds import model_transport

ROOT = Path(__file__).parents[2]
EVIL = "<b>\x1b[2J\u202eT'\\.npy"


def shown_command(text: str) -> str:
    """Return the command line that a page shows."""
    return html.unescape(re.search(r"<code>(nearfar .*?)</code>", text, re.DOTALL).group(1))


def test_the_environment_dates_pages_and_they_are_the_same_again(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1354320000")
    text = page("title", "")
    assert "2012-12-01 00:00:00 UTC" in text
    assert f"<dd>{version()}</dd>" in text
    assert page("title", "") == text


@pytest.mark.parametrize("value", ["", "soon", "1e9", "9" * 30])
def test_what_is_no_time_counts_for_nothing(monkeypatch, value):
    before = datetime.now(UTC)
    monkeypatch.setenv("SOURCE_DATE_EPOCH", value)
    assert before <= time_of_page() <= datetime.now(UTC)


def test_a_page_shows_its_command_line_so_that_it_can_be_pasted(tmp_path):
    made = tmp_path / EVIL
    world = model_transport(Size(8, 8), Size(8, 8), window=3, far=Size(3, 3))
    np.save(made, world.dense().reshape(8, 8, 8, 8))
    report = tmp_path / "a page.html"
    arguments = ("check", str(made), "--near", "3", "--far", "3x3", "--report", str(report))
    ran = run_nearfar(*arguments)
    assert ran.status == 0, ran.err
    text = report.read_text(encoding="utf-8")
    assert EVIL not in text
    command = shown_command(text)
    assert not re.search("[\x00-\x1f\u202e]", command)
    # As Bash reads it.
    printed = subprocess.run(
        ["bash", "-c", f"set -- {command}; printf '%s\\0' \"$@\""], capture_output=True, check=True
    )
    assert tuple(printed.stdout.decode().split("\0")[1:-1]) == arguments
    assert f"{version()}</dd>" in text
    assert html.escape(PAPER) in text


def test_an_ordinary_command_line_is_as_it_was_typed(tmp_path):
    text = page("title", "", command=shlex.join(["nearfar", "check", "my T.npy"]))
    assert shown_command(text) == "nearfar check 'my T.npy'"


def test_references_are_those_of_the_citation_file():
    # Its fields, without a reader of YAML.
    fields = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    said = re.findall(r'(?:title|name): "(.*?)"', fields)
    title, paper = re.findall(r'^ *title: "(.*?)"', fields, re.MULTILINE)
    assert title in software_reference()
    assert paper.lower() in PAPER.lower()
    assert "The nearfar developers" in said
    assert "The nearfar developers" in software_reference()
    for name in re.findall(r"family-names: (\w+)", fields):
        assert name in PAPER
    assert re.search(r"year: (\d+)", fields)[1] in PAPER


def transport_of(plan, **provenance) -> Transport:
    world = model_transport(plan.projector, Size(5, 7), window=3, far=Size(3, 3), channels=3)
    world.provenance.update({"method": "joint", "square": False} | provenance)
    return world


def test_methods_have_the_numbers_of_the_capture():
    plan, _ = choose_plan(Size(12, 16), 40)
    methods = reconstruction_methods(transport_of(plan), plan, checked_by_photos(None))
    text = methods.text
    assert "projector of 12x16 pixels to a camera of 5x7 pixels (3 channels)" in text
    assert "from 40 photos" in text
    for purpose, count in plan.counts.items():
        assert not count or f"{count} of" in text or f"{count} to check by" in text, purpose
    assert f"window of {plan.window} x {plan.window}" in text
    assert f"band of {plan.far} frequencies" in text
    assert "by the phase of the sinusoids' own photos" in text
    assert "was not compared with photos" in text
    # Each reference is referred to, and each that is referred to is there.
    referred = set(re.findall(r"\[(\d)\]", text))
    assert referred == {str(place + 1) for place in range(len(methods.references))}


def test_methods_of_the_papers_plan_are_the_papers():
    plan = paper_plan(Size(12, 16), 3, Size(3, 3))
    transport = transport_of(plan, method="paper", square=True)
    text = reconstruction_methods(transport, plan, "Checked.").text
    assert "its inverse" in text
    assert "by photos of stripes" in text
    assert "by the estimator of [1]" in text
    assert "averaged by the projector pixel" in text
    given = reconstruction_methods(transport, plan, "Checked.", correspondence_given=True).text
    assert "was known beforehand" in given


def test_methods_of_a_comparison_cite_the_rivals_that_were_compared():
    def cited(*names: str):
        trials = tuple(Trial(name, 40, 40, 40.0, 30.0, 40.0, 20.0) for name in names)
        return comparison_methods(Comparison("cornell", Size(8, 8), Size(8, 8), trials, ()))

    assert len(cited("joint", "brute force").references) == 2
    both = cited("joint", "Hadamard", "CLT")
    assert "compressive (CLT) [3], Hadamard [4]" in both.text
    assert "Peers" in both.references[2]
    assert "Schechner" in both.references[3]
    # One paper may describe two methods.
    arnoldi = cited("Arnoldi", "Arnoldi after D", "symmetric")
    assert "optical Arnoldi [3], optical Arnoldi, D first [3], symmetric [4]" in arnoldi.text
    assert len(arnoldi.references) == 4
