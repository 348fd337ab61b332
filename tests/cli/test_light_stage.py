"""Light stages by the command line: photos under one lamp each, gains by references, relighting."""

import shutil

import numpy as np
import pytest

from nearfar.errors import StorageError
from nearfar.files.codecs import encode_png
from nearfar.transport.store import load_transport
from nearfar.workflow.light_stage import import_light_stage
from nearfar.workflow.light_stage_photos import read_light_stage
from tests.cli.conftest import check_done, check_sentence, run_nearfar

LAMPS, CAMERA = 12, (40, 30)
NOISE, BLACK = 12.0, 900.0
LISTED = "# of three photos\nall.png: all\nleft.png: 0-5, 7*0.5\n\nsome.png: lamp-02 lamp-11\n"


def _save(path, light):
    """Write a photo of 16 bits."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(encode_png(np.rint(light).astype(np.uint16)))


@pytest.fixture(scope="module")
def scene():
    """The picture under each lamp as it really is (n, y, x, 3), in levels, and the gains."""
    generator = np.random.default_rng(0)
    y, x = np.indices(CAMERA) / np.reshape(CAMERA, (2, 1, 1))
    normals = np.stack([np.sin(7 * x + 3 * y), np.cos(5 * y - 2 * x), 0.6 + 0 * x], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    directions = generator.normal(size=(LAMPS, 3))
    directions[:, 2] = np.abs(directions[:, 2]) + 0.3
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    albedo = generator.uniform(0.2, 1.0, (*CAMERA, 3))
    shading = np.maximum(np.einsum("yxi,ni->nyx", normals, directions), 0.0) + 0.05
    return 3000 * shading[..., None] * albedo, generator.uniform(0.8, 1.25, LAMPS), directions


@pytest.fixture(scope="module")
def folder(scene, tmp_path_factory):
    """Photos of single lamps, whose power was not that of the references, and a transport."""
    pictures, gains, directions = scene
    made = tmp_path_factory.mktemp("stage")
    generator = np.random.default_rng(1)

    def shoot(name, light):
        _save(made / name, light + BLACK + NOISE * generator.normal(size=light.shape))

    for number, picture in enumerate(pictures):
        shoot(f"lamps/lamp-{number:02}.png", picture / gains[number])
    shoot("black.png", np.zeros_like(pictures[0]))
    shoot("refs/all.png", 0.995 * pictures.sum(axis=0))
    shoot("refs/left.png", 1.005 * (pictures[:6].sum(axis=0) + 0.5 * pictures[7]))
    shoot("refs/some.png", pictures[2] + pictures[11])
    (made / "refs" / "list.txt").write_text(LISTED)
    np.savetxt(made / "directions.csv", directions, delimiter=",")
    check_done(run_nearfar(*_import(made, made / "stage.zarr")))
    return made


def _import(folder, output, **changed):
    options = {
        "--references": folder / "refs" / "list.txt",
        "--black": folder / "black.png",
        "--directions": folder / "directions.csv",
        **{f"--{name}": value for name, value in changed.items()},
    }
    given = [word for pair in options.items() for word in pair if pair[1] is not None]
    return ("import", "--lamps", folder / "lamps", output, *given)


def test_gains_are_those_of_the_lamps_within_their_errors(folder, scene):
    provenance = load_transport(folder / "stage.zarr").provenance
    errors = np.array(provenance["lamp_gain_errors"])
    off = (np.array(provenance["lamp_gains"]) - scene[1]) / errors
    assert errors.max() < 0.02
    assert np.sqrt(np.mean(off**2)) < 2
    exposures = [each["exposure"] for each in provenance["references"].values()]
    np.testing.assert_allclose(exposures, [0.995, 1.005, 1.0], atol=0.005)


@pytest.mark.parametrize("kind", ["npy", "csv", "txt", "colour", "picture"])
def test_a_list_of_weights_relights(folder, scene, kind, tmp_path):
    weights = np.random.default_rng(2).random(LAMPS)
    light, exact = tmp_path / f"light.{kind}", np.tensordot(weights, scene[0], axes=1)
    match kind:
        case "npy":
            np.save(light, weights)
        case "csv":
            light.write_text(",".join(f"{each:.6f}" for each in weights))
        case "txt":
            light.write_text("\n".join(f"{each:.6f}" for each in weights))
        case "colour":
            light = light.with_suffix(".csv")
            colours = np.stack([weights, 0.5 * weights, 0 * weights], axis=1)
            np.savetxt(light, colours, delimiter=",")
            exact = exact * [1.0, 0.5, 0.0]
        case "picture":
            light = light.with_suffix(".png")
            light.write_bytes(encode_png(np.rint(65535 * weights[None]).astype(np.uint16)))
    out = tmp_path / "relit.npy"
    check_done(run_nearfar("relight", folder / "stage.zarr", light, out))
    error = np.load(out) - exact / 65535
    # The noise of the black photo is in every lamp's light: 34.6 dB if all of it added up.
    assert 20 * np.log10(np.linalg.norm(exact / 65535) / np.linalg.norm(error)) > 36


def test_error_bars_cover_noise_and_gains(folder, scene, tmp_path):
    weights = np.random.default_rng(3).random(LAMPS)
    np.save(tmp_path / "light.npy", weights)
    out, bars = tmp_path / "relit.npy", tmp_path / "bars.npy"
    args = (folder / "stage.zarr", tmp_path / "light.npy")
    check_done(run_nearfar("relight", *args, out))
    check_done(run_nearfar("relight", *args, bars, "--error-bars"))
    off = (np.load(out) - np.tensordot(weights, scene[0], axes=1) / 65535) / np.load(bars)
    assert 0.7 < np.sqrt(np.mean(off**2)) < 1.4


def test_info_says_what_it_is(folder):
    said = check_done(run_nearfar("info", folder / "stage.zarr")).out
    assert said.startswith("good: Relit reference photos")
    assert "light stage, a photo under each lamp: gains from 0.8" in said
    assert "no near or far range: 12 lamps" in said
    assert "directly lit" not in said


def test_nothing_is_kept_of_direct_and_near_light(folder):
    kept = load_transport(folder / "stage.zarr")
    assert kept.parts == ("free",)
    assert not any((folder / "stage.zarr" / name).exists() for name in ("direct", "near"))
    assert not kept.lit.any()


@pytest.mark.parametrize("gain", ["direct=2", "near=0"])
def test_gains_of_absent_parts_get_a_sentence(folder, tmp_path, gain):
    np.save(tmp_path / "light.npy", np.ones(LAMPS))
    ran = run_nearfar(
        "relight", folder / "stage.zarr", tmp_path / "light.npy", tmp_path / "o.npy", "--gain", gain
    )
    check_sentence(ran, gain.split("=")[0])


def test_what_cannot_be_split_physically_gets_a_sentence(folder, tmp_path):
    np.save(tmp_path / "light.npy", np.ones(LAMPS))
    light, out = tmp_path / "light.npy", tmp_path / "o.npy"
    ran = run_nearfar("relight", folder / "stage.zarr", light, out, "--gain", "subsurface=2")
    check_sentence(ran, "cannot be split physically")
    assert not out.exists()


def test_without_references_gains_are_1_and_nothing_is_checked(folder, tmp_path):
    ran = check_done(run_nearfar(*_import(folder, tmp_path / "t.zarr", references=None)))
    assert "doubtful: Nothing was checked" in ran.out
    assert "--references" in ran.out
    np.save(tmp_path / "light.npy", np.ones(LAMPS))
    light, out = tmp_path / "light.npy", tmp_path / "o.npy"
    check_done(run_nearfar("relight", tmp_path / "t.zarr", light, out))
    bars = run_nearfar("relight", tmp_path / "t.zarr", light, tmp_path / "b.npy", "--error-bars")
    check_sentence(bars, "no error bars")


def test_without_black_a_warning_says_so(folder, tmp_path):
    ran = run_nearfar(*_import(folder, tmp_path / "t.zarr", black=None))
    assert ran.status == 0
    assert "no photo without lamps" in ran.err


def test_a_reference_that_no_gains_explain_is_told(folder, scene, tmp_path):
    """Everything moved before one of the photos."""
    moved = np.roll(scene[0].sum(axis=0), 5, axis=1)
    _save(_copy(folder, tmp_path) / "refs" / "all.png", moved + BLACK)
    verdict = run_nearfar(*_import(tmp_path, tmp_path / "t.zarr")).out.splitlines()[-1]
    assert verdict.startswith("wrong: No gains of the lamps explain the reference photos, all.png")


def test_references_of_other_lamps_than_listed_turn_lamps_off(folder, tmp_path):
    (_copy(folder, tmp_path) / "refs" / "list.txt").write_text(LISTED.replace("0-5", "6-11"))
    assert "its gain is 0" in run_nearfar(*_import(tmp_path, tmp_path / "t.zarr")).err


def _copy(folder, tmp_path):
    for part in ("lamps", "refs"):
        shutil.copytree(folder / part, tmp_path / part)
    for part in ("black.png", "directions.csv"):
        shutil.copy(folder / part, tmp_path / part)
    return tmp_path


def _small(folder):
    _save(folder / "lamps" / "lamp-05.png", np.zeros((10, 10, 3)))


def _dark(folder):
    _save(folder / "lamps" / "lamp-05.png", np.full((*CAMERA, 3), BLACK))


def _listing(text):
    return lambda folder: (folder / "refs" / "list.txt").write_text(text)


FAULTS = {
    "another size": (_small, ("lamp-05.png", "10 x 10", "one camera")),
    "a dark lamp": (_dark, ("lamp-05.png", "as dark as without its lamp")),
    "no such lamp": (_listing("all.png: 0-12"), ("list.txt", "'0-12'", "from lamp-00")),
    "no colon": (_listing("all.png all"), ("line 1", "no colon")),
    "nothing listed": (_listing("# nothing\n"), ("lists no reference",)),
    "bad share": (_listing("all.png: 3*much"), ("3*much",)),
    "no lamp": (_listing("all.png:"), ("names no lamp",)),
    "no such photo": (_listing("none.png: all"), ("none.png", "not there")),
    "a lamp as reference": (_listing("../lamps/lamp-01.png: 1"), ("lamp-01.png", "single lamps")),
    "broken JSON": (_listing('{"all.png": '), ("no JSON",)),
    "too few directions": (
        lambda folder: (folder / "directions.csv").write_text("1 0 0\n"),
        ("directions.csv", "1 rows of 3", "12 lamps"),
    ),
    "no direction": (
        lambda folder: np.savetxt(folder / "directions.csv", np.zeros((LAMPS, 3))),
        ("directions.csv", "no direction"),
    ),
    "words": (
        lambda folder: (folder / "directions.csv").write_text("north\n"),
        ("line 1", "not of numbers"),
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_bad_input_gets_a_sentence(folder, tmp_path, name):
    spoil, says = FAULTS[name]
    spoil(_copy(folder, tmp_path))
    check_sentence(run_nearfar(*_import(tmp_path, tmp_path / "t.zarr")), *says)
    assert not (tmp_path / "t.zarr").exists()


def test_a_list_may_be_json(folder, tmp_path):
    (folder / "refs" / "list.json").write_text('{"all.png": "all", "some.png": "2 11"}')
    references = folder / "refs" / "list.json"
    check_done(run_nearfar(*_import(folder, tmp_path / "t.zarr", references=references)))
    assert list(load_transport(tmp_path / "t.zarr").provenance["references"]) == [
        "all.png",
        "some.png",
    ]


def test_weights_of_another_number_of_lamps_get_a_sentence(folder, tmp_path):
    (tmp_path / "light.csv").write_text("1\n2\n3\n")
    ran = run_nearfar("relight", folder / "stage.zarr", tmp_path / "light.csv", tmp_path / "o.npy")
    check_sentence(ran, "light.csv", "3 rows of 1", "12 lamps")


@pytest.mark.parametrize("option", ["--references", "--black", "--directions"])
def test_what_belongs_to_lamps_is_refused_with_patterns(folder, tmp_path, option):
    ran = run_nearfar(
        "import", "--patterns", folder / "lamps", folder / "lamps", tmp_path / "c.zarr", option, "x"
    )
    assert ran.status == 2
    assert option in ran.err


def test_photos_in_a_file_are_those_in_memory(folder, tmp_path):
    stages = [
        read_light_stage(
            folder / "lamps",
            references=folder / "refs" / "list.txt",
            black=folder / "black.png",
            memory=memory,
            scratch=tmp_path,
        )
        for memory in (10**9, 1)
    ]
    transports = []
    for number, stage in enumerate(stages):
        import_light_stage(stage, tmp_path / f"{number}.zarr")
        transports.append(load_transport(tmp_path / f"{number}.zarr"))
    in_memory, in_file = transports
    np.testing.assert_array_equal(in_file.far, in_memory.far)
    np.testing.assert_array_equal(in_file.noise, in_memory.noise)
    assert in_file.provenance == in_memory.provenance
    # Nothing of the temporary file is left.
    assert sorted(path.name for path in tmp_path.iterdir()) == ["0.zarr", "1.zarr"]


def test_no_room_for_photos_gets_a_sentence(folder, tmp_path):
    with pytest.raises(StorageError, match=r"cannot be kept in .*nowhere"):
        read_light_stage(folder / "lamps", memory=1, scratch=tmp_path / "nowhere")
