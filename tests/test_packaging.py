"""Wheel and sdist build, and what they install runs by itself."""

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    (wheel,), (sdist,) = folder.glob("*.whl"), folder.glob("*.tar.gz")
    return wheel, sdist


@pytest.mark.slow
def test_the_wheel_holds_the_package_and_nothing_else(built):
    with zipfile.ZipFile(built[0]) as wheel:
        names = wheel.namelist()
    source = ROOT / "src"
    expected = {
        str(path.relative_to(source))
        for path in (source / "nearfar").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert {name for name in names if ".dist-info/" not in name} == expected
    assert "nearfar/viewer/pages/view/main.js" in names
    assert "nearfar/py.typed" in names
    assert any(name.endswith("licenses/LICENSE") for name in names)


@pytest.mark.slow
def test_the_sdist_holds_what_is_needed_to_build_and_test(built):
    with tarfile.open(built[1]) as sdist:
        names = {name.split("/", 1)[1] for name in sdist.getnames() if "/" in name}
    assert {"pyproject.toml", "README.md", "LICENSE", "Makefile", "tests/conftest.py"} <= names
    assert "docs/conf.py" in names
    assert not [name for name in names if name.startswith((".venv", "docs/_build", "nearfar-demo"))]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [0, 1], ids=["wheel", "sdist"])
def test_what_is_installed_runs_by_itself(built, kind, tmp_path):
    command = [
        sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index",
        "--no-build-isolation", "--disable-pip-version-check", "--target", tmp_path / "there",
        built[kind],
    ]  # fmt: skip
    subprocess.run([str(word) for word in command], check=True)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "there")}

    def run(*words):
        return subprocess.run(
            [sys.executable, *map(str, words)], cwd=tmp_path, env=environment,
            capture_output=True, text=True, check=True,
        ).stdout  # fmt: skip

    where = run("-c", "import nearfar; print(nearfar.__file__)")
    assert str(tmp_path / "there") in where
    assert run("-m", "nearfar", "--version").startswith("nearfar 0.")
    run("-m", "nearfar", "plan", "--projector", "16x16", "--photos", "30", "-o", "plan.json")
    assert "30 photos" in run("-m", "nearfar", "info", "plan.json")
    program = "from nearfar.viewer.assets import read_page; print(*read_page('view'))"
    source = ROOT / "src" / "nearfar" / "viewer" / "pages" / "view"
    assert set(run("-c", program).split()) == {path.name for path in source.iterdir()}


def _completed(shell, words):
    """What a shell is told may follow words."""
    environment = {
        **os.environ,
        "_NEARFAR_COMPLETE": f"complete_{shell}",
        "COMP_WORDS": words,
        "COMP_CWORD": str(words.count(" ")),
        "_TYPER_COMPLETE_ARGS": words,
        "_TYPER_COMPLETE_FISH_ACTION": "get-args",
    }
    program = "import sys; sys.argv = ['nearfar']; from nearfar.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_shells_complete_commands_and_scenes(shell):
    told = _completed(shell, "nearfar re")
    for name in ("reconstruct", "relight", "render"):
        assert name in told
    assert "acquire" not in told
    for command in ("compare", "render", "acquire plan.json capture.zarr --rig", "separate --rig"):
        told = _completed(shell, f"nearfar {command} cor")
        assert "cornell-aside" in told
        assert "corner" in told
        assert "wedge" not in told
    # Whatever else it may be is a file, which shells know better.
    assert "cornell" not in _completed(shell, "nearfar compare my")
