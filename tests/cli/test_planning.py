"""Plans and their patterns as files."""

import json
from pathlib import Path

import imagecodecs
import numpy as np
import pytest

from nearfar.arrays import Size
from nearfar.plan import choose_plan, read_plan
from nearfar.plan.choose_frequencies import NOISE
from nearfar.plan.look import look_at, photos_for_window
from nearfar.plan.typical import noise_of, typical_of
from nearfar.scenes.hostile import hostile_transport
from nearfar.transport.store import load_transport
from tests.cli.conftest import PLAN, Job, check_done, check_sentence, run_nearfar


@pytest.mark.parametrize(
    ("options", "photos", "total", "savings"),
    [
        (("128x128", "--near", "19", "--far", "13x13"), 1060, 1316, 16384 / 1060),
        (("128x128", "--near", "15", "--far", "13x13"), 788, 1044, 16384 / 788),
        (
            ("68x100", "--near", "19", "--far", "7x10", "--drop", "3x3", "--offset", "none"),
            423,
            423 + 168,
            6800 / 423,
        ),
        (
            ("16x20", "--near", "5", "--far", "3x3", "--correspondence", "none"),
            2 * (1 + 25 - 1 + 9),
            2 * (1 + 25 - 1 + 9),
            320 / 68,
        ),
    ],
)
@pytest.mark.parametrize("quiet", [(), ("--quiet",)])
def test_json_has_these_keys_and_stands_alone(options, photos, total, savings, quiet):
    ran = check_done(run_nearfar("plan", "--projector", *options, "--json", *quiet))
    found = json.loads(ran.out)
    keys = ["photos", "transport_photos", "total_photos", "brute_force", "savings"]
    assert list(found)[: len(keys)] == keys
    assert found["expected_dB"] is None
    purposes = ["direct", "near", "far", "reference", "correspondence", "check"]
    assert list(found["photos"]) == purposes
    assert found["transport_photos"] == photos
    assert found["total_photos"] == total == sum(found["photos"].values())
    assert found["savings"] == pytest.approx(savings, rel=1e-12)
    assert sum(found["photos"][name] for name in ("direct", "near", "far")) == photos


def test_json_stands_alone_beside_a_file(tmp_path: Path):
    ran = check_done(run_nearfar(*PLAN, "--json", "-o", tmp_path / "plan.json"))
    summary = read_plan(tmp_path / "plan.json").summary()
    assert json.loads(ran.out) == {**summary, "expected_dB": None, "look": None}


def test_quiet_says_nothing(tmp_path: Path):
    plan = tmp_path / "plan.json"
    assert check_done(run_nearfar(*PLAN, "-o", plan, "--quiet")).out == ""
    assert check_done(run_nearfar("export", plan, tmp_path / "patterns", "-q")).out == ""
    assert check_done(run_nearfar("info", plan, "--quiet")).out == ""


@pytest.mark.parametrize(
    ("options", "scale", "frame"),
    [
        ((), 1, (16, 20)),
        (("--scale", "3"), 3, (48, 60)),
        (("--native", "50x70"), 3, (50, 70)),
        (("--native", "50x70", "--scale", "2"), 2, (50, 70)),
        (("--native", "16x20"), 1, (16, 20)),
    ],
)
def test_patterns_are_blocks_in_the_middle_of_a_black_frame(
    finished, tmp_path: Path, options, scale, frame
):
    out = tmp_path / "patterns"
    ran = check_done(run_nearfar("export", finished.plan, out, *options))
    plan = read_plan(finished.plan)
    count = len(plan.patterns)
    names = sorted(path.name for path in out.iterdir())
    assert names == [*(f"pattern-{i:05d}.png" for i in range(count)), "plan.json"]
    assert read_plan(out / "plan.json") == plan
    assert f"{frame[0]}x{frame[1]}" in ran.out
    top, left = (frame[0] - 16 * scale) // 2, (frame[1] - 20 * scale) // 2
    for i in range(0, count, 11):
        shown = imagecodecs.png_decode((out / f"pattern-{i:05d}.png").read_bytes())
        assert shown.dtype == np.uint8
        assert shown.shape == frame
        block = np.kron(plan.draw(i), np.ones((scale, scale), dtype=np.uint8))
        inside = (slice(top, top + 16 * scale), slice(left, left + 20 * scale))
        np.testing.assert_array_equal(shown[inside], block)
        rest = shown.copy()
        rest[inside] = 0
        assert not rest.any()


def test_pairs_of_exported_patterns_sum_to_white(finished):
    shown = [
        imagecodecs.png_decode((finished.patterns / f"pattern-{i:05d}.png").read_bytes())
        for i in range(68)
    ]
    for pattern, inverse in zip(shown[::2], shown[1::2], strict=True):
        assert (pattern.astype(int) + inverse == 255).all()
    assert len({pattern.tobytes() for pattern in shown}) == 68


def test_pictures_without_a_plan_are_not_an_export(finished: Job, tmp_path: Path):
    mine = tmp_path / "photos"
    mine.mkdir()
    (mine / "pattern-1.png").write_bytes(b"a photo of wallpaper")
    check_sentence(run_nearfar("export", finished.plan, mine, "--force"), mine)
    assert [path.name for path in mine.iterdir()] == ["pattern-1.png"]
    (mine / "pattern-1.png").unlink()
    check_done(run_nearfar("export", finished.plan, mine, "--force"))
    check_done(run_nearfar("export", finished.plan, mine, "--force"))


def test_a_number_of_photos_is_the_whole_command(tmp_path: Path):
    plan = tmp_path / "plan.json"
    ran = check_done(run_nearfar("plan", "--projector", "16x20", "--photos", 40, "-o", plan))
    chosen = read_plan(plan)
    assert 39 <= len(chosen.patterns) <= 40
    as_json = check_done(run_nearfar("plan", "--projector", "16x20", "--photos", 40, "--json"))
    found = json.loads(as_json.out)
    assert {name: found[name] for name in chosen.summary()} == chosen.summary()
    expected = choose_plan((16, 20), 40)[1]
    for light, value in expected._asdict().items():
        low, high = found["expected_dB"][light]
        assert low < value < high
        assert f"{low:.0f} to {high:.0f} dB under" in ran.out
    assert "scenes of direct, near-range and far-range light" in ran.out


def test_a_plan_for_every_pixel_of_a_projector_says_so(tmp_path: Path):
    plan = tmp_path / "plan.json"
    ran = check_done(run_nearfar("plan", "--projector", "270x480", "--photos", 60, "-o", plan))
    assert read_plan(plan).pitch == 8
    assert "for every projector pixel: the window's functions are 8 projector pixels" in ran.out
    assert "up to 32 pixels from q, 12% of the screen's shorter side" in ran.out
    assert "plan for blocks of pixels" in ran.out
    assert "--projector 90x160, and nearfar export --native 270x480" in ran.out
    info = check_done(run_nearfar("info", plan))
    assert "for every projector pixel" in info.out
    blocks = check_done(run_nearfar("plan", "--projector", "27x48", "--photos", 60))
    assert "for every projector pixel" not in blocks.out
    ran = run_nearfar("plan", "--projector", "270x480", "--photos", 60, "--near", 35)
    check_sentence(ran, "W = 35 at a pitch of 8 projector pixels does not fit")


@pytest.mark.parametrize(
    ("options", "status", "said"),
    [
        ((), 2, "give --photos N"),
        (("--near", 5), 2, "give --photos N"),
        (("--photos", 40, "--far", "3x3"), 2, "paper's plan"),
        (("--photos", 40, "--offset", "inverse"), 2, "leave --offset out"),
        (("--photos", 40, "--correspondence", "stripes"), 2, "leave --correspondence out"),
        (("--photos", 0), 2, "photos"),
        (("--photos", 9), 1, "too few"),
        (("--photos", 40, "--near", 99), 1, "does not fit"),
    ],
)
def test_half_a_plan_is_refused(tmp_path: Path, options, status, said):
    plan = tmp_path / "plan.json"
    ran = run_nearfar("plan", "--projector", "16x20", *options, "-o", plan)
    assert ran.status == status
    assert said in ran.err
    assert "Traceback" not in ran.err
    assert not plan.exists()


def test_a_plan_for_the_scene_of_a_quick_look(finished: Job, tmp_path: Path):
    plan, capture, look = (tmp_path / name for name in ("quick.json", "c.zarr", "look.zarr"))
    check_done(run_nearfar("plan", "--projector", "16x20", "--photos", 40, "-o", plan))
    check_done(run_nearfar("acquire", plan, capture, "--rig", finished.truth))
    check_done(run_nearfar("reconstruct", capture, look))
    chosen = tmp_path / "chosen.json"
    wanted = ("--projector", "16x20", "--photos", 60)
    ran = run_nearfar("plan", *wanted, "--look", look, "-o", chosen)
    assert "of relighting this scene" in check_done(ran).out
    seen = load_transport(look)
    # Entries of that world's windows are as bright far from q as near it.
    assert "reaches further than the look's W = 5: planned with W = 9" in ran.out
    by_noise = [
        choose_plan(seen.projector, 60, window=9, typical=typical_of(seen), noise=noise)[0]
        for noise in (noise_of(seen), NOISE)
    ]
    assert read_plan(chosen) == by_noise[0] != by_noise[1]
    own = ("--near", 5, "--look", look)
    assert "planned with W = 5\n" in check_done(run_nearfar("plan", *wanted, *own)).out
    ran = run_nearfar("plan", *wanted, "--near", 7, "--look", look)
    needed = photos_for_window(look_at(seen), seen.projector, 60, window=7)
    said = f"planned with W = 7, as asked, for which about {needed} photos leave as little unknown"
    assert said in check_done(ran).out
    for arguments, said in (
        (("--projector", "16x24", "--photos", 60, "--look", look), "same pattern grid"),
        (("--projector", "16x20", "--photos", 60, "--look", finished.transport), "--method joint"),
    ):
        check_sentence(run_nearfar("plan", *arguments), said)
    ran = run_nearfar("plan", "--projector", "16x20", "--near", 5, "--far", "3x3", "--look", look)
    assert ran.status == 2


def test_a_look_at_what_is_not_direct_near_and_far_light_asks_for_every_frequency(tmp_path: Path):
    scene = hostile_transport("permuted", Size(12, 12), Size(12, 12))
    rig, plan, capture, look = (tmp_path / n for n in ("T.npy", "p.json", "c.zarr", "look.zarr"))
    np.save(rig, scene.far[0].reshape(12, 12, 12, 12))
    wanted = ("plan", "--projector", "12x12")
    check_done(run_nearfar(*wanted, "--photos", 50, "-o", plan))
    check_done(run_nearfar("acquire", plan, capture, "--rig", rig))
    check_done(run_nearfar("reconstruct", capture, look))
    for photos, said in ((150, "all frequencies are shown"), (100, "147 photos")):
        ran = check_done(run_nearfar(*wanted, "--photos", photos, "--look", look))
        assert "is not direct, near-range and far-range light alone" in ran.out
        assert said in ran.out
    codes = tmp_path / "codes.json"
    ran = check_done(run_nearfar(*wanted, "--photos", 170, "--look", look, "-o", codes))
    assert "codes of half of the projector's pixels, which tell all of them apart" in ran.out
    assert "all frequencies are shown" in ran.out
    assert read_plan(codes).is_by_codes
    ran = check_done(run_nearfar(*wanted, "--photos", 150, "--look", look, "--json"))
    found = json.loads(ran.out)
    assert found["look"]["model_holds"] is False
    assert found["transport_photos"] >= 144
