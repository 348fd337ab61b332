"""What the pages show was run: by their build, or here on a virtual rig."""

import ast
import dataclasses
import importlib
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
import typer

from nearfar.cli.application import app
from nearfar.cli.commands import COMMANDS
from nearfar.faults import of_light, of_photos, of_single_photos, records
from nearfar.plan import paper_plan
from nearfar.rigs.tables import RealTable, SimulatedTable
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.verdict.verdict import SENTENCES
from tests.rigs.displays import one_monitor
from tests.rigs.loopback import alone_on_the_loopback
from tests.rigs.test_loop import CAMERA, PROJECTOR, SCREEN, Bench

DOCS = Path(__file__).parents[1] / "docs"
# Pages that the build writes, and records, show nothing to run.
OTHERS = {"_build", "decisions", "command-line.md", "licences.md"}
PAGES = sorted(page for page in DOCS.rglob("*.md") if not OTHERS & set(page.parts))
# Shown without being run as they stand: installing, what blocks until someone ends it, and one
# that takes a plan's whole run. Each is run by the tests that are named.
ELSEWHERE = {
    "pip": "tests/test_packaging.py",
    "nearfar view": "tests/viewer/test_view.py",
    "nearfar calibrate": "tests/cli/test_depth.py",
}


def fences(page):
    """Yield the kind and the text of each fenced block of a page."""
    yield from re.findall(r"^```\{?([\w-]*)\}?[^\n]*\n(.*?)^```$", page.read_text(), re.M | re.S)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_block_of_a_page_is_run(page):
    for kind, text in fences(page):
        # Tables of a RIG.toml are read by test_the_rig_files_that_are_shown_are_read.
        if kind in {"run", "on-a-rig", "toctree", "eval-rst", "toml", "include"}:
            continue
        assert kind == "", f"{page.name}: a block of {kind}"
        for line in text.splitlines():
            known = [start for start in ELSEWHERE if line.startswith(start)]
            assert known, f"{page.name}: {line!r} is shown and not run"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_that_are_named_in_passing_are_there(page):
    for shown in re.findall(r"`nearfar ([a-z]+)[^`]*`", page.read_text()):
        assert shown in COMMANDS


def test_the_rig_files_that_are_shown_are_read():
    shown = {page.name: [text for kind, text in fences(page) if kind == "toml"] for page in PAGES}
    assert {name for name, texts in shown.items() if texts} == {"real-rig.md", "scenes.md"}
    (real,), (text,) = shown["real-rig.md"], shown["scenes.md"]
    assert RealTable.model_validate(tomllib.loads(real)).camera.driver == "aravis"
    table = SimulatedTable.model_validate(tomllib.loads(text))
    assert table.camera.bits == 14
    # Uncommented lines too.
    SimulatedTable.model_validate(tomllib.loads(text.replace("# exposure", "exposure")))


def test_the_counts_of_the_papers_plans():
    page = (DOCS / "howto" / "window-and-band.md").read_text()
    rows = re.findall(r"\| (\d+)x(\d+) \| (\d+) \| (\d+)x(\d+) \| (\d+) \| ([\d.]+) times", page)
    assert len(rows) == 3
    for height, width, window, far_height, far_width, photos, times in rows:
        theory = photos == "423"
        plan = paper_plan(
            (int(height), int(width)),
            int(window),
            (int(far_height), int(far_width)),
            dropped=(3, 3) if theory else None,
            offset="none" if theory else "inverse",
        )
        assert plan.transport_photos == int(photos)
        assert f"{plan.savings:.2f}" == times


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    """A display, and a camera that sees a scene lit by it; as on a desk."""
    folder = tmp_path_factory.mktemp("desk")
    world = cached_scene("cornell", PROJECTOR, CAMERA)
    lights = np.eye(PROJECTOR.pixels, dtype=np.float32).reshape(-1, *PROJECTOR)
    transport = world.pictures(lights).mean(axis=-1).reshape(PROJECTOR.pixels, -1).T
    np.save(folder / "transport.npy", 0.7 / transport.sum(axis=1).max() * transport)
    with alone_on_the_loopback(), one_monitor(SCREEN) as display:
        bench = Bench(folder, display, "DESK")
        yield bench
        bench.close()


# They wait for the loopback until `tests.rigs.test_loop` has done: later than other slow files.
@pytest.mark.slow(minutes=0.1)
@pytest.mark.parametrize("name", ["tutorial.md", "howto/real-rig.md"])
def test_what_is_shown_on_a_rig_runs_on_one(rig, name, tmp_path):
    rig.folder = tmp_path
    first = True
    for kind, text in fences(DOCS / name):
        if kind != "on-a-rig":
            continue
        for line in text.strip().splitlines():
            command = shlex.split(line)
            assert command[0] == "nearfar"
            said = rig.do(*command[1:])
            if command[1] == "devices":
                assert "Aravis-Fake-DESK" in said
            if command[1] == "init":
                # What a user is asked to look over: this camera is smaller than a real one.
                _look_over(tmp_path / "rig.toml")
                first = False
    assert not first


def _look_over(path):
    text = path.read_text()
    assert 'driver = "aravis"' in text
    assert "Aravis-Fake-DESK" in text
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    kept = [
        line for line in lines if not re.match(r"(exposure|settle|region|pixel_format)\b", line)
    ]
    camera = kept.index("[camera]")
    settings = ['region = "30x36"', 'pixel_format = "Mono16"', "exposure = 0.016667"]
    kept[camera + 1 : camera + 1] = settings
    projector = kept.index("[projector]")
    kept.insert(projector + 1, "settle = 1")
    path.write_text("\n".join(kept) + "\n")


@pytest.fixture
def reference(monkeypatch):
    """What writes the pages of the command line and of licences."""
    monkeypatch.syspath_prepend(DOCS / "extensions")
    return importlib.import_module("reference")


def test_the_reference_has_every_argument_and_option_of_every_command(reference, tmp_path):
    reference.write_command_line(tmp_path)
    page = (tmp_path / "command-line.md").read_text()
    sections = dict(
        re.findall(r"^### nearfar (\S+)\n(.*?)(?=^#|\Z)", page, re.MULTILINE | re.DOTALL)
    )
    assert set(sections) == set(COMMANDS.own)
    group = typer.main.get_command(app)
    for name, section in sections.items():
        for parameter in group.commands[name].params:
            common = {"--force", "--quiet"} & set(parameter.opts)
            if parameter.param_type_name == "option" and not common:
                shown = f"`{', '.join(sorted(parameter.opts, key=len))}"
                assert (shown in section) != parameter.hidden, (name, shown)
        assert f"```bash\nnearfar {name}" in section
        assert "[required]" not in section


def test_every_command_has_its_place_in_the_reference(reference):
    GROUPS, dependencies, licence_of = (
        reference.GROUPS,
        reference.dependencies,
        reference.licence_of,
    )
    assert sorted(name for names in GROUPS.values() for name in names) == sorted(COMMANDS.own)
    needed = dependencies()
    assert {"numpy", "zarr"} <= set(needed[""])
    assert "fastapi" in needed["viewer"]
    for name in needed[""]:
        licence = licence_of(name)
        assert licence != "not told", name
        assert not re.search(r"(?<![L])A?GPL|non-?commercial", licence, re.I), f"{name}: {licence}"


def rows_of(page):
    """Yield what the first column of each table of a page says, header rows left out."""
    for line in page.read_text().splitlines():
        if line.startswith("| ") and not line.startswith(("| message |", "| --- ")):
            yield line.split(" | ")[0].removeprefix("| ").strip()


def matches(shown, sentence):
    """Return whether a sentence is one that a page shows with … for what changes."""
    parts = (re.escape(part.strip()) for part in shown.split("…"))
    return re.search(".*".join(parts), sentence, re.DOTALL) is not None


def sentences_in(text):
    """Yield the sentences of a source file, with … for values."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.JoinedStr):
            parts = (part.value if isinstance(part, ast.Constant) else "…" for part in node.values)
            yield "".join(parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


TROUBLESHOOTING = DOCS / "howto" / "troubleshooting.md"
A_FAULT = {
    of_photos.Moved: [
        {"what": what, "photo": 3, "pixels": pixels, "until": until}
        for what in ("camera", "scene", "projector", "camera's focus")
        for pixels, until in ((0.5, None), (0.5, 9), (None, 9))
    ],
    of_single_photos.ShowsOtherPattern: [
        *({"photos": (3, 4), "others": others} for others in ((4, 3), (2, 3), (9, 1))),
        *(
            {"photos": tuple(range(8)), "others": others}
            for others in (tuple(range(8))[::-1], tuple(range(-3, 5)))
        ),
    ],
    of_photos.NotLinear: [{"encoding": encoding} for encoding in ("", "sRGB")],
}
VALUES = {
    "camera": "the camera",
    "capture": Path("capture.zarr"),
    "change": records.LightChange("lamp", 0.1),
    "frequency": (0, 1),
    "gains": (0.04, 0.0, -0.04),
    "how": "mirrored left to right",
    "is_calibrated": False,
    "is_interlaced": False,
    "last_good": 1,
    "others": (4,),
    "pattern": "white",
    "patterns": "two patterns",
    "photo": 3,
    "photos": (3,),
    "reason": "it was lost",
}


def faults_by_class():
    for module in (records, of_light, of_photos, of_single_photos):
        for name, kind in vars(module).items():
            if dataclasses.is_dataclass(kind) and kind.__module__ == module.__name__:
                # What is part of another fault's sentence.
                if name == "LightChange":
                    continue
                fields = [field.name for field in dataclasses.fields(kind)]
                given = A_FAULT.get(kind, [{}])
                for values in given:
                    yield kind(**{each: VALUES.get(each, 0.5) for each in fields} | values)


@pytest.mark.parametrize(
    "sentence", [*map(str, faults_by_class()), *SENTENCES.values()], ids=lambda text: text[:40]
)
def test_every_fault_of_photos_has_its_row(sentence):
    assert any(matches(shown, sentence) for shown in rows_of(TROUBLESHOOTING))


def test_what_the_page_of_messages_shows_is_said():
    said = [
        sentence
        for path in (DOCS.parent / "src" / "nearfar").rglob("*.py")
        for sentence in sentences_in(path.read_text())
    ]
    shown = list(rows_of(TROUBLESHOOTING))
    # The last table is of sorts of errors.
    messages = shown[: shown.index("… is there already …") + 1]
    assert len(messages) > 50
    for message in messages:
        parts = [part.strip() for part in message.split("…") if len(part.strip()) > 12]
        assert any(all(part in sentence for part in parts) for sentence in said), message
