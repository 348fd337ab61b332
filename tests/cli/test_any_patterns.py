"""Other people's patterns and photos by the command line: import, info, correspond."""

import shutil

import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.capture import open_capture
from nearfar.plan import paper_plan
from tests.cli.conftest import check_done, check_sentence, run_nearfar
from tests.shown import (
    cornell,
    fringes,
    gray_code,
    hadamard,
    photograph,
    random_binary,
    white_and_black,
    with_inverses,
    write_pictures,
)

SIZE = Size(32, 32)
CAMERA = Size(40, 36)


@pytest.fixture(scope="module")
def world():
    return cornell(SIZE, CAMERA)


@pytest.fixture(scope="module")
def gray():
    return [
        *(picture for axis in (0, 1) for picture in with_inverses(gray_code(SIZE, axis))),
        *white_and_black(SIZE),
    ]


@pytest.fixture(scope="module")
def folders(world, gray, tmp_path_factory):
    """Folders of Gray code and of photos of it."""
    folder = tmp_path_factory.mktemp("gray")
    photos = [photo.mean(axis=-1).astype(np.uint16) for photo in photograph(world, gray)]
    return write_pictures(folder / "patterns", gray), write_pictures(folder / "photos", photos)


def _import(patterns, photos, output, *options):
    return run_nearfar(
        "import", "--patterns", patterns, photos, output, "--full-scale", 16383, *options
    )


def _off(world, q):
    """Return how far q is off, at camera pixels where it was found and there is direct light."""
    found = np.isfinite(q).all(axis=-1) & world.lit
    return np.abs(q - world.correspondence)[found].max(axis=1), found


def test_gray_code_is_imported_described_and_decoded(world, gray, folders, tmp_path):
    capture, q, sure = tmp_path / "c.zarr", tmp_path / "q.npy", tmp_path / "c.npy"
    said = check_done(_import(*folders, capture)).out
    assert "Gray code of rows, bits 0 to 4, with inverses (10 pictures)" in said
    assert "Gray code of columns, bits 0 to 4, with inverses (10 pictures)" in said
    described = check_done(run_nearfar("info", capture)).out
    assert "32x32, 22 pictures of somebody else's" in described
    assert "Gray code of rows, bits 0 to 4, with inverses (10 pictures)" in described
    kept = open_capture(capture)
    for number, picture in enumerate(gray):
        np.testing.assert_array_equal(kept.pattern(number), picture / np.float32(255))
    said = check_done(run_nearfar("correspond", capture, q, "--confidence", sure)).out
    assert "projector of 32x32" in said
    off, found = _off(world, np.load(q))
    assert found.mean() > 0.85
    assert np.mean(off < 0.5) > 0.95
    confidence = np.load(sure)
    assert confidence.shape == tuple(CAMERA)
    assert confidence[found].min() > 0.99
    # The same, counted in the pixels of a coarser grid.
    coarse = tmp_path / "coarse.npy"
    check_done(run_nearfar("correspond", capture, coarse, "--projector", "16x8"))
    fine = np.load(q)
    np.testing.assert_allclose(
        np.load(coarse)[found], ((fine + 0.5) / [2, 4] - 0.5)[found], atol=1e-5
    )


def test_patterns_of_one_axis_tell_this_axis_and_say_so(world, tmp_path):
    pictures = fringes(SIZE, 1, [32, 8], 8)
    photos = list(photograph(world, pictures))
    patterns = write_pictures(tmp_path / "p", pictures)
    capture, q = tmp_path / "c.zarr", tmp_path / "q.npy"
    check_done(_import(patterns, write_pictures(tmp_path / "f", photos), capture))
    ran = run_nearfar("correspond", capture, q)
    assert ran.status == 0
    assert "no pattern tells rows apart: q is NaN on that axis" in ran.err
    found = np.load(q)
    assert np.isnan(found[..., 0]).all()
    across = np.isfinite(found[..., 1])
    assert across.mean() > 0.9
    assert np.median(np.abs(found[..., 1] - world.correspondence[..., 1])[across]) < 0.1


def test_random_patterns_in_colour_are_told_channel_by_channel(world, tmp_path):
    generator = np.random.default_rng(0)
    pictures = [(generator.random((*SIZE, 3)) < 0.5).astype(np.uint8) * 255 for _ in range(20)]
    light = np.ones(3, dtype=np.float32) * 16000
    photos = []
    for picture in pictures:
        lit = [world @ (picture[..., k] / np.float32(255)) for k in range(3)]
        photos.append(np.stack([lit[k].mean(axis=-1) for k in range(3)], axis=-1) * light)
    patterns = write_pictures(tmp_path / "p", pictures)
    taken = write_pictures(tmp_path / "f", [photo.astype(np.uint16) for photo in photos])
    said = check_done(_import(patterns, taken, tmp_path / "c.zarr")).out
    assert "colour pictures" in said
    check_done(run_nearfar("correspond", tmp_path / "c.zarr", tmp_path / "q.npy"))
    off, found = _off(world, np.load(tmp_path / "q.npy"))
    assert found.mean() > 0.9
    assert np.mean(off < 0.5) > 0.95


def test_a_display_that_is_not_linear_is_said_and_allowed_for(world, tmp_path):
    pictures = [
        *(p for axis in (0, 1) for p in fringes(SIZE, axis, [32, 8], 3)),
        *(p for axis in (0, 1) for p in with_inverses(gray_code(SIZE, axis))),
    ]
    shown = [(picture / 255.0) ** 2.2 * 255 for picture in pictures]
    patterns = write_pictures(tmp_path / "p", pictures)
    photos = write_pictures(tmp_path / "f", photograph(world, shown))
    check_done(_import(patterns, photos, tmp_path / "c.zarr"))
    ran = run_nearfar("correspond", tmp_path / "c.zarr", tmp_path / "q.npy")
    assert ran.status == 0
    assert "projector or camera is not linear" in ran.err
    power = float(ran.err.split("to a power of about ")[1].split()[0])
    assert power == pytest.approx(2.2, abs=0.25)
    assert "1 is linear" in " ".join(ran.err.split())
    off, found = _off(world, np.load(tmp_path / "q.npy"))
    assert found.mean() > 0.85
    assert np.mean(off < 0.5) > 0.9


def test_nearfars_own_patterns_are_a_plan_again(world, tmp_path):
    plan = paper_plan(SIZE, 5, (5, 5))
    pictures = [plan.draw(i) for i in range(len(plan.patterns))]
    patterns = write_pictures(tmp_path / "p", pictures)
    photos = write_pictures(tmp_path / "f", photograph(world, pictures))
    check_done(_import(patterns, photos, tmp_path / "c.zarr"))
    assert open_capture(tmp_path / "c.zarr").plan.offset == "inverse"
    q = tmp_path / "q.npy"
    check_done(run_nearfar("correspond", tmp_path / "c.zarr", q))
    off, _ = _off(world, np.load(q))
    assert np.mean(off < 0.5) > 0.95


def _fewer(patterns, photos):
    (photos / "p21.png").unlink()
    return patterns, photos


def _other_size(patterns, photos):
    write_pictures(patterns, [np.zeros((30, 32), np.uint8)])
    return patterns, photos


def _other_photo_size(patterns, photos):
    write_pictures(photos, [np.zeros((30, 32), np.uint16)])
    return patterns, photos


def _empty(patterns, photos):
    for picture in patterns.iterdir():
        picture.unlink()
    return patterns, photos


def _missing(patterns, photos):
    return patterns / "no", photos


def _jpeg(patterns, photos):
    (patterns / "p0.png").write_bytes(b"\xff\xd8\xff\xe0" + bytes(100))
    return patterns, photos


def _cut(patterns, photos):
    data = (patterns / "p3.png").read_bytes()
    (patterns / "p3.png").write_bytes(data[: len(data) // 2])
    return patterns, photos


def _too_bright(patterns, photos):
    for number in range(22):
        (patterns / f"p{number}.png").unlink()
        np.save(patterns / f"p{number}.npy", np.full(SIZE, 255.0, dtype=np.float32))
    return patterns, photos


def _one_for_both(patterns, _photos):
    return patterns, patterns / "p0.png"


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (_fewer, "has 21 photos (first p0.png, last p20.png), but"),
        (_other_size, "p1.png is 32x32, but p0.png is 30x32"),
        (_other_photo_size, "photo 1"),
        (_empty, "has no pictures"),
        (_missing, "is not there"),
        (_jpeg, "p0.png is a JPEG"),
        (_cut, "p3.png is damaged or cut short"),
        (_too_bright, "has values from 255 to 255"),
        (_one_for_both, "cannot be read as a folder"),
    ],
)
def test_mistakes_at_import_get_a_sentence_and_leave_nothing(spoil, words, folders, tmp_path):
    copies = [shutil.copytree(folder, tmp_path / folder.name) for folder in folders]
    patterns, photos = spoil(*copies)
    assert words in check_sentence(_import(patterns, photos, tmp_path / "c.zarr"))
    assert not (tmp_path / "c.zarr").exists()


@pytest.mark.parametrize(
    ("order", "words"),
    [
        (lambda n: list(range(n))[::-1], "the photos are in reverse order"),
        (lambda n: [*range(1, n), 0], "the first photo stands one place too early"),
        (lambda n: sorted(range(n), key=str), "names as text"),
        (lambda n: [i ^ 1 for i in range(n)], "swapped with the one of its inverse"),
        (lambda n: np.random.default_rng(0).permutation(n).tolist(), "in the same order"),
    ],
)
def test_photos_of_another_order_are_noticed(order, words, folders, tmp_path):
    patterns, photos = folders
    count = len(list(photos.iterdir()))
    listed = tmp_path / "list.txt"
    listed.write_text("\n".join(f"p{number}.png" for number in order(count)))
    ran = _import(patterns, photos, tmp_path / "c.zarr", "--list", listed)
    if ran.status == 1:
        # White and black stand where they cannot be.
        assert "out of order" in ran.err
        return
    ran = run_nearfar("correspond", tmp_path / "c.zarr", tmp_path / "q.npy")
    assert ran.status == 0
    assert "the photos do not follow the patterns" in ran.err
    assert words in ran.err


def test_patterns_that_tell_no_place_are_refused(world, tmp_path):
    pictures = white_and_black(SIZE) * 4
    patterns = write_pictures(tmp_path / "p", pictures)
    photos = write_pictures(tmp_path / "f", photograph(world, pictures))
    check_done(_import(patterns, photos, tmp_path / "c.zarr"))
    said = check_sentence(run_nearfar("correspond", tmp_path / "c.zarr", tmp_path / "q.npy"))
    assert "same everywhere" in said
    assert not (tmp_path / "q.npy").exists()


def test_wrong_usage_of_import_is_told():
    assert run_nearfar("import", "a", "b").status == 2
    assert run_nearfar("import", "--patterns", "a", "b", "c", "d").status == 2
    assert run_nearfar("correspond", "c.zarr", "q.png").status in {1, 2}


def test_random_and_hadamard_patterns_tell_both_axes(world, tmp_path):
    rows = np.random.default_rng(0).permutation(SIZE.pixels)[:50]
    for name, pictures in (
        ("random", random_binary(SIZE, 50)),
        ("hadamard", [hadamard(SIZE)[row] for row in rows]),
    ):
        patterns = write_pictures(tmp_path / name / "p", pictures)
        photos = write_pictures(tmp_path / name / "f", photograph(world, pictures))
        check_done(_import(patterns, photos, tmp_path / f"{name}.zarr"))
        q = tmp_path / f"{name}.npy"
        check_done(run_nearfar("correspond", tmp_path / f"{name}.zarr", q))
        off, found = _off(world, np.load(q))
        assert found.mean() > 0.9
        assert np.mean(off < 0.5) > 0.95


def test_random_blocks_on_a_fine_screen_count_in_its_pixels(world, tmp_path):
    pictures = random_binary(SIZE, 40)
    shown = [np.kron(picture, np.ones((12, 20), np.uint8)) for picture in pictures]
    patterns = write_pictures(tmp_path / "p", shown)
    photos = write_pictures(tmp_path / "f", photograph(world, pictures))
    check_done(_import(patterns, photos, tmp_path / "c.zarr"))
    said = check_done(run_nearfar("correspond", tmp_path / "c.zarr", tmp_path / "q.npy")).out
    assert "projector of 384x640" in said
    in_blocks = (np.load(tmp_path / "q.npy") + 0.5) / [12, 20] - 0.5
    off, found = _off(world, in_blocks)
    assert found.mean() > 0.9
    assert np.mean(off < 0.5) > 0.95
