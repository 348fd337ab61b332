"""The viewer's page in a browser: keyframes, films of them, and what is copied as a command."""

import base64
import json
import subprocess
import sys
import zipfile
from io import BytesIO

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from nearfar.files import read_light, read_picture
from nearfar.files.codecs import decode_png
from nearfar.files.video import enlarged
from tests.cli.conftest import run_nearfar
from tests.viewer.asking import PROJECTOR, message
from tests.viewer.browsing import drag, saved, seen, settled, show, slide, tone
from tests.waiting import LONGEST_WAIT, wait_until

pytestmark = pytest.mark.slow

SPOT = {"kind": "spot", "x": 5, "y": 8, "radius": 4}
# A light that moves, and one of another kind that it fades into.
KEYFRAMES = [SPOT, {**SPOT, "x": 17, "colour": "#ff8000"}, {"kind": "checkerboard", "side": 3}]
FILM = {"keyframes": KEYFRAMES, "seconds": 0.4, "rate": 5}


def _of_the_address(page):
    return json.loads(page.evaluate("decodeURIComponent(location.hash.slice(1)) || '{}'"))


def _names(page):
    return page.locator("#keyframes .name").all_inner_texts()


@pytest.mark.parametrize(("width", "height"), [(1300, 900), (1900, 1000)])
def test_keyframes_are_seen_without_scrolling(open_page, address, width, height):
    page = open_page(address, {"keyframes": KEYFRAMES})
    page.set_viewport_size({"width": width, "height": height})
    page.click("#tab-keyframes")
    for id_ in ("#keyframes .name >> nth=2", "#play-keyframes"):
        box = page.locator(id_).bounding_box()
        assert box["y"] > 0
        assert box["y"] + box["height"] <= height


def test_lights_are_kept_put_in_order_and_played(open_page, address):
    page = open_page(address)
    assert page.is_disabled("#play-keyframes")
    for kind in ("spot", "white", "stripe"):
        page.click(f"[data-kind={kind}]")
        page.click("#add-keyframe")
    # The light stays in view, and the keyframes' tab tells that there is something new.
    page.click("#tab-keyframes.news")
    spot, white, stripe = _names(page)
    assert (white, stripe.split()[0]) == ("white", "stripe")
    assert page.is_disabled("[aria-label='keyframe 1 earlier']")
    page.click("[aria-label='keyframe 3 earlier']")
    assert _names(page) == [spot, stripe, white]
    page.click("[aria-label='remove keyframe 2']")
    page.keyboard.press("Control+z")
    assert _names(page) == [spot, stripe, white]
    page.click("[aria-label='remove keyframe 2']")
    assert _names(page) == [spot, white]
    slide(page, "seconds", 0.5)
    assert page.inner_text("#film-length").endswith("0.5 s")
    # From the first to the last, where it stops.
    page.click("#keyframes .name >> nth=0")
    settled(page)
    first = seen(page, "light")
    page.click("#play-keyframes")
    wait_until(lambda: page.inner_text("#play-keyframes") == "play keyframes")
    settled(page)
    assert (seen(page, "light") == 255).all()
    page.keyboard.press("Control+z")
    settled(page)
    np.testing.assert_array_equal(seen(page, "light"), first)
    # They come back with the address, by the keyboard alone as well.
    page.keyboard.press("k")
    names = _names(page)
    assert len(names) == 3
    wait_until(lambda: len(_of_the_address(page).get("keyframes", ())) == 3)
    page.reload()
    settled(page)
    assert _names(page) == names


def test_a_film_of_pictures_is_what_relight_makes_of_its_lights(
    open_page, address, stored, transport, tmp_path
):
    page = open_page(address, {**FILM, "near": 2, "exposure": 1, "tab": "keyframes"})
    assert page.inner_text("#film-length") == "5 pictures, 0.8 s"
    path = saved(page, "#film-pictures", tmp_path)
    assert path.name == "a-scene-3-keyframes.zip"
    wait_until(lambda: page.inner_text("#film-status") == "5 pictures saved")
    with zipfile.ZipFile(path) as archive:
        assert archive.namelist()[:2] == [
            "a-scene-3-keyframes-0.png",
            "lights/a-scene-3-keyframes-0.png",
        ]
        pictures = [decode_png(archive.read(name)) for name in archive.namelist()[::2]]
        archive.extractall(tmp_path, archive.namelist()[1::2])
    paths = sorted((tmp_path / "lights").iterdir())
    lights = [
        np.broadcast_to(np.atleast_3d(read_light(path, PROJECTOR)), (*PROJECTOR, 3))
        for path in paths
    ]
    for light, picture in zip(lights, pictures, strict=True):
        relit = transport.relight(light, near=2.0)
        assert np.abs(picture - tone(2 * relit)).max() <= 1
    # Halfway the spot is halfway, and the light that fades is half of either.
    x = np.arange(PROJECTOR.width)
    middle = [np.average(x, weights=light[..., 0].sum(axis=0)) for light in lights[:3]]
    assert middle == pytest.approx([5, 11, 17], abs=0.1)
    np.testing.assert_allclose(lights[3], (lights[2] + lights[4]) / 2, atol=1e-4)
    # The command that the page gives makes the same pictures: a moving and a fading one.
    for path in (paths[0], paths[2], paths[4]):
        path.unlink()
    page.click("[data-tab=light]")
    page.click("#copy-as")
    (tmp_path / "a scene.zarr").symlink_to(stored)
    loop = page.inner_text("#as-loop").replace("nearfar relight", '"$0" -m nearfar relight')
    subprocess.run(["sh", "-c", loop, sys.executable], cwd=tmp_path, check=True)
    for path, picture in zip(paths[1::2], pictures[1::2], strict=True):
        again = decode_png((tmp_path / f"relit-{path.name}").read_bytes())
        assert np.abs(picture.astype(int) - again).max() <= 1


def test_exposure_follows_the_light_in_a_film(open_page, address, transport, tmp_path):
    page = open_page(address, {**FILM, "metering": "auto", "tab": "keyframes"})
    assert page.inner_text("#film-length").endswith("exposure follows the light")
    # What the page shows of each light at rest is what the film has of it.
    shown = []
    for number in range(3):
        page.click(f"#keyframes .name >> nth={number}")
        settled(page)
        shown.append(seen(page).astype(int))
    with zipfile.ZipFile(saved(page, "#film-pictures", tmp_path)) as archive:
        of_film = [decode_png(archive.read(name)) for name in archive.namelist()[::2]]
    for one, other in zip(shown, of_film[::2], strict=True):
        assert np.percentile(other, 99.5) > 240
        assert np.abs(one - other).max() <= 1
    page.click("[data-tab=light]")
    page.click("#copy-as")
    assert page.is_visible("#loop-note")


def test_a_film_plays_in_a_browser_and_shows_the_pictures(open_page, address, tmp_path):
    cv2 = pytest.importorskip("cv2")
    page = open_page(address, {**FILM, "tab": "keyframes"})
    pictures = saved(page, "#film-pictures", tmp_path)
    film = saved(page, "#film-mp4", tmp_path)
    assert film.name == "a-scene-3-keyframes.mp4"
    with zipfile.ZipFile(pictures) as archive:
        expected = [enlarged(decode_png(archive.read(name))) for name in archive.namelist()[::2]]
    capture = cv2.VideoCapture(str(film))
    frames = []
    while (frame := capture.read())[0]:
        frames.append(frame[1][..., ::-1])
    capture.release()
    assert len(frames) == len(expected)
    for frame, picture in zip(frames, expected, strict=True):
        # Compressed, with colour at every second pixel.
        assert np.sqrt(np.mean((frame.astype(float) - picture) ** 2)) < 6
    # The browser knows its codec, its size and how long it is.
    page.goto("about:blank")
    height, width, seconds = page.evaluate(
        """data => new Promise((done, failed) => {
        const film = document.createElement('video');
        film.onerror = () => failed(new Error(film.error.message));
        film.onseeked = () => done([film.videoHeight, film.videoWidth, film.duration]);
        film.onloadeddata = () => { film.currentTime = 0.5; };
        film.src = 'data:video/mp4;base64,' + data; document.body.append(film); film.load(); })""",
        base64.b64encode(film.read_bytes()).decode(),
    )
    assert (height, width) == expected[0].shape[:2]
    assert seconds == pytest.approx(1, abs=0.05)


def test_films_are_of_the_relit_scene_alone(open_page, address):
    page = open_page(address, {"keyframes": KEYFRAMES, "tool": "reach", "tab": "keyframes"})
    for button in ("#film-pictures", "#film-mp4"):
        assert page.is_disabled(button)
    assert "choose relit" in page.inner_text("#film-length")
    assert not page.is_disabled("#play-keyframes")
    page.click("[data-tool=relit]")
    wait_until(lambda: not page.is_disabled("#film-mp4"))
    assert "relit" not in page.inner_text("#film-length")


def test_a_film_is_cancelled(open_page, address):
    page = open_page(
        address, {"keyframes": KEYFRAMES, "seconds": 20, "rate": 60, "tab": "keyframes"}
    )
    page.click("#film-pictures")
    wait_until(lambda: int((page.inner_text("#film-status") or "picture 0").split()[1]) > 2)
    page.click("#film-cancel")
    assert page.inner_text("#film-status") == ""
    assert page.inner_text("#fault") == ""
    # Another one is made after it.
    slide(page, "seconds", 0.1)
    slide(page, "rate", 5)
    page.click("#film-pictures")
    wait_until(lambda: page.inner_text("#film-status") == "2 pictures saved")


@pytest.mark.parametrize(
    "header",
    [
        b"\x00",
        "{",
        '{"format":"gif","name":"x","rate":5,"count":2}',
        '{"format":"mp4","name":"../x","rate":5,"count":2}',
        '{"format":"mp4","name":"x","rate":5,"count":1000000}',
        '{"format":"mp4","name":"x","rate":5,"count":2,"exposure":1e9}',
        "x" * 10_000,
    ],
)
def test_a_header_that_is_no_film_s_is_refused(address, header):
    with connect(address.replace("http", "ws") + "/film") as socket:
        socket.send(header)
        assert "film" in json.loads(socket.recv(timeout=LONGEST_WAIT))["fault"]
        with pytest.raises(ConnectionClosed) as refusal:
            socket.recv(timeout=LONGEST_WAIT)
        assert refusal.value.rcvd.code == 1008


def test_a_film_is_of_lights_only(address):
    with connect(address.replace("http", "ws") + "/film") as socket:
        socket.send(json.dumps({"format": "pictures", "name": "x", "rate": 5, "count": 1}))
        socket.send(message(np.ones((3, 3))))
        assert "send 20x24" in json.loads(socket.recv(timeout=LONGEST_WAIT))["fault"]
    with connect(address.replace("http", "ws") + "/film", max_size=None) as socket:
        socket.send(json.dumps({"format": "pictures", "name": "x", "rate": 5, "count": 1}))
        socket.send(message(np.ones(PROJECTOR)))
        assert json.loads(socket.recv(timeout=LONGEST_WAIT)) == {"done": 1}
        data = socket.recv(timeout=LONGEST_WAIT)
        assert zipfile.ZipFile(BytesIO(data)).namelist() == ["x-0.png", "lights/x-0.png"]


# What the page gives to be copied


@pytest.mark.parametrize(
    "state",
    [
        {"kind": "white"},
        {**SPOT, "colour": "#ff8040", "near": 2.5, "far": 0, "exposure": 1.3, "gamma": 1.8},
        {"kind": "paint", "solo": "far", "exposure": 4, "channel": "green",
         "strokes": [{"colour": "#80ff40", "radius": 3, "points": [4, 4, 15, 9]}]},
        {**SPOT, "tool": "reach", "range": "ring", "reach": 2, "broad": 3, "exposure": 2},
        {**SPOT, "split": "physical", "subsurface": 0.5, "interreflection": 2},
    ],
    ids=["white", "gains", "one component and colour", "a ring", "physical"],
)  # fmt: skip
def test_what_is_copied_makes_the_picture_again(open_page, address, stored, tmp_path, state):
    page = open_page(address, state)
    if state.get("split") == "physical":
        wait_until(lambda: "found" in page.inner_text("#split-status"))
        settled(page)
    if state.get("tool") == "reach":
        wait_until(lambda: '"stage":true' in page.evaluate("document.body.dataset.frame"))
    shown = seen(page).astype(int)
    page.click("#copy-as")
    command, python = (page.inner_text(f"#as-{what}") for what in ("command", "python"))
    saved(page, "#copy-light", tmp_path)
    (tmp_path / "a scene.zarr").symlink_to(stored)
    name = next(
        word for word in command.split() if word.endswith(".png") and "light.png" not in word
    )
    run = '"$0" -m ' + command
    subprocess.run(["sh", "-c", run, sys.executable], cwd=tmp_path, check=True)
    by_command = decode_png((tmp_path / name).read_bytes())
    assert np.abs(shown - np.atleast_3d(by_command)).max() <= 1
    (tmp_path / name).unlink()
    subprocess.run([sys.executable, "-c", python], cwd=tmp_path, check=True)
    np.testing.assert_array_equal(decode_png((tmp_path / name).read_bytes()), by_command)


def test_the_dialog_is_used_by_the_keyboard(open_page, address):
    page = open_page(address)
    page.focus("#copy-as")
    page.keyboard.press("Enter")
    page.wait_for_selector("#copying[open]")
    # Keys of the page rest.
    page.keyboard.press("5")
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.focus("[data-copy=as-command]")
    page.keyboard.press("Enter")
    page.wait_for_selector("#copied:has-text('copied')")
    assert page.evaluate("navigator.clipboard.readText()") == page.inner_text("#as-command")
    page.keyboard.press("Escape")
    page.wait_for_selector("#copying[open]", state="hidden")
    assert page.get_attribute("[data-kind=spot]", "aria-pressed") == "true"


def test_names_say_scene_and_light(open_page, address, tmp_path):
    page = open_page(address, {**SPOT, "solo": "near"})
    assert saved(page, "#save-png", tmp_path).name == "a-scene-spot-x5-y8-r4-near-only.png"
    assert saved(page, "#save-exr", tmp_path).name == "a-scene-spot-x5-y8-r4-near-only.exr"
    assert saved(page, "#save-light", tmp_path).name == "a-scene-spot-x5-y8-r4.light.png"
    show(page, address, {"kind": "paint"})
    drag(page, (3, 3), (3, 20))
    assert saved(page, "#save-light", tmp_path).name == "a-scene-paint-1-stroke.light.png"


def test_looks_are_for_pictures_to_look_at(stored, tmp_path):
    from nearfar.files import write_light

    write_light(tmp_path / "white.png", np.ones(PROJECTOR, np.float32))
    for options, said in (
        (("--exposure", 1), "ends in .png"),
        (("--gamma", 2), "ends in .png"),
        (("--channel", "red"), "ends in .png"),
    ):
        ran = run_nearfar("relight", stored, tmp_path / "white.png", tmp_path / "x.exr", *options)
        assert ran.status == 2
        assert said in " ".join(ran.err.replace("│", " ").split())
    ran = run_nearfar(
        "relight", stored, tmp_path / "white.png", tmp_path / "x.png", "--channel", "grey"
    )
    assert ran.status == 2
    assert not (tmp_path / "x.exr").exists()
    assert run_nearfar("relight", stored, tmp_path / "white.png", tmp_path / "a.exr").status == 0
    look = ("--exposure", -1, "--channel", "red")
    ran = run_nearfar("relight", stored, tmp_path / "white.png", tmp_path / "a.png", *look)
    assert ran.status == 0
    expected = tone(read_picture(tmp_path / "a.exr")[..., 0] / 2)
    assert np.abs(decode_png((tmp_path / "a.png").read_bytes()) - expected).max() <= 1
