"""The viewer's server: its frames, pixels, maps, and the files that it reads."""

import json
import os
import signal
import struct
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from nearfar.arrays import Size, middles
from nearfar.errors import InputError, MissingFileError
from nearfar.estimate.error_bars import ErrorBars
from nearfar.files import read_light, read_picture, write_picture
from nearfar.files.codecs import encode_npy, encode_png, encode_tiff
from nearfar.markup import MARK
from nearfar.transport.rows import of_rows
from nearfar.transport.store import save_transport
from nearfar.viewer import application, interactive
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.messages import pack, unpack_light
from nearfar.viewer.payloads import pack_map
from nearfar.viewer.server import ListeningAddress, serve
from nearfar.viewer.transport_row import transport_row
from tests.absent import said_without
from tests.cli.conftest import run_nearfar
from tests.viewer.asking import (
    CAMERA,
    PROJECTOR,
    ask,
    frame,
    message,
    refused,
    relit,
    socket_of,
    unpack,
)
from tests.viewer.conftest import served_view
from tests.waiting import LONGEST_WAIT
from tests.worlds import model_transport

# Pictures


@pytest.mark.parametrize("name", ["white", "black", "spot", "random", "coloured"])
def test_pictures_are_those_of_the_transport(address, transport, lights, name):
    header, parts = relit(address, lights[name])
    assert (header["stride"], header["exact"]) == (1, True)
    expected = np.stack(transport.components(lights[name]))
    # Half precision keeps 11 digits; 65535 levels keep 16.
    np.testing.assert_allclose(parts, expected, rtol=1e-3, atol=2e-5)


def test_a_colour_is_that_of_a_coloured_light(address, transport, lights):
    _, parts = relit(address, lights["spot"], colour=[1.0, 0.25, 0.0])
    expected = np.stack(transport.components(lights["spot"][..., None] * [1.0, 0.25, 0.0]))
    np.testing.assert_allclose(parts, expected, rtol=1e-3, atol=2e-5)


def _thin(pictures, step):
    """The middle of each cell of pictures (parts, y, x, colours)."""
    rows, columns = (middles(side, step) for side in pictures.shape[1:3])
    return pictures[:, rows[:, None], columns]


@pytest.mark.parametrize("memory", [10**9, 10**5])
def test_a_large_scene_is_coarse_while_the_light_moves_and_exact_at_rest(
    serve_it, transport, lights, monkeypatch, memory
):
    monkeypatch.setattr(interactive, "MAXIMUM_COARSE_BYTES", 60_000)
    monkeypatch.setattr(interactive, "BLOCK_BYTES", 50_000)
    address = serve_it(memory=memory)
    expected = np.stack(transport.components(lights["random"]))
    with socket_of(address) as socket:
        socket.send(message(lights["random"]))
        header, coarse = frame(socket)
        assert not header["exact"]
        step = header["stride"]
        assert step > 1
        np.testing.assert_allclose(coarse, _thin(expected, step), rtol=1e-3, atol=2e-5)
        header, exact = frame(socket)
        assert (header["exact"], header["stride"]) == (True, 1)
        np.testing.assert_allclose(exact, expected, rtol=1e-3, atol=2e-5)


def test_larger_photos_than_a_page_shows_are_thinned_out(serve_it, transport, lights, monkeypatch):
    monkeypatch.setattr(interactive, "MAXIMUM_DISPLAYED_PIXELS", CAMERA.pixels // 3)
    monkeypatch.setattr(interactive, "BLOCK_BYTES", 50_000)
    header, parts = relit(serve_it(), lights["random"])
    assert header["stride"] == 2
    expected = _thin(np.stack(transport.components(lights["random"])), 2)
    np.testing.assert_allclose(parts, expected, rtol=1e-3, atol=2e-5)


def test_lights_that_come_faster_than_pictures_do_not_queue(serve_it, transport, lights):
    with socket_of(serve_it()) as socket:
        for number in range(1, 200):
            socket.send(message(lights["random"] * (number / 199), number=number))
        pictures = 0
        while True:
            header, parts = frame(socket)
            pictures += 1
            if header["number"] == 199 and header["exact"]:
                break
    assert pictures <= 199
    expected = np.stack(transport.components(lights["random"]))
    np.testing.assert_allclose(parts, expected, rtol=1e-3, atol=2e-5)


def test_what_is_saved_is_what_the_command_line_relights(
    address, stored, lights, tmp_path, transport
):
    gains = {"direct": 0.5, "near": 2.0, "far": 1.5}
    body = message(lights["random"], gains=gains, colour=[1.0, 0.5, 0.25])
    (tmp_path / "light.png").write_bytes(ask(address, "/light.png", body))
    (tmp_path / "page.exr").write_bytes(ask(address, "/picture.exr", body))
    options = [word for name, gain in gains.items() for word in ("--gain", f"{name}={gain}")]
    ran = run_nearfar("relight", stored, tmp_path / "light.png", tmp_path / "cli.exr", *options)
    assert ran.status == 0
    page, cli = (read_picture(tmp_path / name) for name in ("page.exr", "cli.exr"))
    assert page.shape == (*CAMERA, 3)
    np.testing.assert_allclose(page, cli, atol=2e-5)
    assert cli.max() > 0.1
    light = read_light(tmp_path / "light.png", PROJECTOR)
    np.testing.assert_allclose(light[..., 0], lights["random"], atol=1e-5)
    np.testing.assert_allclose(light[..., 2], lights["random"] / 4, atol=1e-5)


# Pixels and maps


def test_a_camera_pixel_tells_its_row(address, transport):
    y, x = 17, 30
    header, (window, far, window_error, far_error, spectrum) = unpack(
        ask(address, f"/row?y={y}&x={x}")
    )
    d, n, f = (part[0] for part in transport.component_rows(slice(y * 42 + x, y * 42 + x + 1)))
    np.testing.assert_allclose(window, (d + n).mean(axis=0).reshape(PROJECTOR), atol=1e-6)
    np.testing.assert_allclose(far, f.mean(axis=0).reshape(PROJECTOR), atol=1e-6)
    assert header["q"] == pytest.approx(transport.correspondence[y, x].tolist())
    assert header["floodlit"]["near"] == pytest.approx(n.mean(axis=0).sum(), abs=1e-5)
    bars = ErrorBars(transport).component_rows(slice(y * 42 + x, y * 42 + x + 1))
    line = round(float(transport.correspondence[y, x, 0]))
    assert header["line"] == line
    along = slice(line * PROJECTOR.width, (line + 1) * PROJECTOR.width)
    # Of the mean of three channels.
    expected = np.sqrt((bars.far[0] ** 2).sum(axis=0)) / 3
    np.testing.assert_allclose(far_error, expected[along], rtol=1e-4)
    expected = np.sqrt((bars.direct[0] ** 2 + bars.near[0] ** 2).sum(axis=0)) / 3
    np.testing.assert_allclose(window_error, expected[along], rtol=1e-4)
    assert 1 < np.count_nonzero(window_error) <= transport.window
    assert spectrum.max() == 0
    assert np.unravel_index(spectrum.argmax(), PROJECTOR) == (10, 12)
    assert header["k_far"][0] <= header["k_near"][0] <= 0.5
    # The band's own, however far f reaches beyond it.
    cycles = np.abs(transport.far_basis.cycles)
    edge = np.array(transport.provenance["plan"]["far"]) // 2 / np.array(PROJECTOR)
    assert np.any(cycles > edge + 1e-6)
    assert np.all(header["k_far"] <= edge + 1e-6)
    assert min(header["k_far"]) > 0


def test_a_camera_pixel_without_direct_light_says_so(address):
    header, (window, *_) = unpack(ask(address, "/row?y=3&x=5"))
    assert header["q"] is None
    assert header["line"] == PROJECTOR.height // 2
    assert not window.any()


def test_a_projector_pixel_tells_its_column(address, transport):
    _, (column,) = unpack(ask(address, "/column?y=7&x=11"))
    np.testing.assert_allclose(column, transport.column(7, 11).mean(axis=-1), atol=1e-6)


def test_every_map_is_there(address, transport):
    about = json.loads(ask(address, "/scene"))
    assert about["projector"] == list(PROJECTOR)
    names = [one["name"] for one in about["maps"]]
    assert set(names) >= {"row", "column", "confidence", "error", "near-share", "saturated"}
    found = {}
    for name in names:
        header, (found[name], saturated) = unpack(ask(address, f"/map/{name}"))
        assert saturated.shape == CAMERA
        assert not saturated.any()
        assert found[name].shape == CAMERA
        assert header["low"] < header["high"]
        assert header["title"]
    np.testing.assert_array_equal(found["row"], transport.correspondence[..., 0])
    np.testing.assert_array_equal(found["confidence"], transport.quality.confidence)
    parts = [part.sum(axis=-1) for part in transport.components(np.ones(PROJECTOR))]
    np.testing.assert_allclose(found["near-share"], 100 * parts[1] / sum(parts), rtol=1e-3)
    white = transport @ np.ones(PROJECTOR, np.float32)
    bars = ErrorBars(transport).picture(np.ones(PROJECTOR, np.float32))
    ratio = 10 * np.log10((white**2).mean(axis=-1) / (bars**2).mean(axis=-1))
    np.testing.assert_allclose(found["error"], ratio, atol=1e-3)


def test_saturated_camera_pixels_are_marked_and_their_errors_unknown(tmp_path, transport):
    saturated = np.zeros(CAMERA, dtype=bool)
    saturated[1, 2] = True
    quality = replace(transport.quality, saturated=saturated)
    save_transport(replace(transport, quality=quality), tmp_path / "t.zarr")
    with served_view(InteractiveTransport(tmp_path / "t.zarr")) as address:
        assert json.loads(ask(address, "/scene"))["mark"] == list(MARK)
        for name in ("column", "confidence", "error", "far-share"):
            header, (values, marks) = unpack(ask(address, f"/map/{name}"))
            np.testing.assert_array_equal(marks, saturated)
            assert np.isnan(values[1, 2])
            assert header["high"] >= header["low"]
        header, (_, _, near_error, far_error, _) = unpack(ask(address, "/row?y=1&x=2"))
        assert header["saturated"]
        assert header["no_errors"] == "they are unknown"
        assert np.isinf(near_error).all()
        assert np.isinf(far_error).all()
        header, (_, _, near_error, far_error, _) = unpack(ask(address, "/row?y=1&x=3"))
        assert not header["no_errors"]
        assert np.isfinite([near_error, far_error]).all()


def test_without_error_bars_noise_is_mapped(stored, tmp_path, transport):
    save_transport(replace(transport, posterior=None, quality=None), tmp_path / "t.zarr")
    with served_view(InteractiveTransport(tmp_path / "t.zarr")) as address:
        about = json.loads(ask(address, "/scene"))
        names = [one["name"] for one in about["maps"]]
        assert "error" not in names
        assert "confidence" not in names
        unpack(ask(address, "/map/noise"))
        header, (_, _, error, _, _) = unpack(ask(address, "/row?y=1&x=2"))
        assert header["no_errors"] == "this estimate does not tell them"
        assert not error.any()


def test_pixels_are_answered_while_a_map_is_computed(serve_it, monkeypatch):
    begun, over = threading.Event(), threading.Event()

    def slow(maps, name):
        begun.set()
        assert over.wait(LONGEST_WAIT)
        return pack_map(maps, name)

    monkeypatch.setattr(application, "pack_map", slow)
    address = serve_it()
    with ThreadPoolExecutor() as asking:
        drawn = asking.submit(ask, address, "/map/error")
        assert begun.wait(LONGEST_WAIT)
        try:
            assert ask(address, "/row?y=1&x=2")
            assert ask(address, "/column?y=1&x=2")
            assert not drawn.done()
        finally:
            over.set()
        header, _ = unpack(drawn.result(30))
        assert header["unit"] == "dB"


# Files that a page sends


def test_lights_and_photos_of_other_formats_are_read(address, transport, lights, tmp_path):
    linear = lights["coloured"].astype(np.float32)
    write_picture(tmp_path / "l.exr", linear)
    for name, data in {
        "l.exr": (tmp_path / "l.exr").read_bytes(),
        "../../l.npy": encode_npy(linear),
        "l.tiff": encode_tiff(linear),
        "l.png": encode_png(np.rint(65535 * linear).astype(np.uint16)),
    }.items():
        _, (levels,) = unpack(ask(address, f"/read/light?name={name}", data))
        np.testing.assert_allclose(levels / 65535, linear, atol=2e-5)
    photo = np.random.default_rng(1).random((*CAMERA, 3)).astype(np.float32)
    header, (seen,) = unpack(ask(address, "/read/photo?name=p.npy", encode_npy(photo)))
    seen = seen.astype(np.float32) / header["scale"]
    np.testing.assert_allclose(seen, photo - transport.black, atol=1e-3)
    eight = np.full((*CAMERA, 3), 188, np.uint8)
    header, (seen,) = unpack(ask(address, "/read/photo?name=p.png", encode_png(eight)))
    seen = seen.astype(np.float32) / header["scale"]
    # Of eight bits it is a picture for looking: 188 in sRGB is half of white.
    np.testing.assert_allclose(seen, 0.5, atol=0.01)


def _bomb():
    """A PNG of a few bytes that claims 60000x60000 pixels."""

    def chunk(kind, data):
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    head = struct.pack(">IIBBBBB", 60000, 60000, 16, 2, 0, 0, 0)
    body = zlib.compress(bytes(10**6))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("kind", "name", "data", "words"),
    [
        ("light", "a.png", encode_png(np.zeros((3, 4), np.uint8)), "a.png is 3x4, and 20x24 is"),
        ("photo", "a.png", encode_png(np.zeros((3, 4), np.uint8)), "a.png is 3x4, and 30x42 is"),
        ("light", "a.npy", encode_npy(np.full(PROJECTOR, 1.5, np.float32)), "goes from 1.5 to 1.5"),
        ("light", "a%00.npy", b"x", "no picture that can be read"),
        ("light", "a.png", b"hello", "no picture that can be read"),
        ("light", "/etc/passwd", b"", "is empty"),
        ("light", "..\\..\\x.exr", b"\x76\x2f\x31\x01" + bytes(40), "x.exr is damaged"),
        ("light", "bomb.png", _bomb(), "bomb.png"),
        ("secret", "a.png", b"", "send a light or a photo"),
    ],
)
def test_files_that_cannot_be_used_get_a_sentence(address, kind, name, data, words):
    status, said = refused(address, f"/read/{kind}?name={name}", data)
    assert status == 400
    assert words in json.loads(said)["fault"]
    assert "/etc" not in said
    assert json.loads(ask(address, "/scene"))["name"] == "a scene.zarr"


# Messages and addresses


def test_a_message_comes_back_as_it_was_packed():
    arrays = [np.arange(5, dtype=np.uint16), np.ones((2, 3), np.float32), np.zeros(3, np.float16)]
    header, found = unpack(pack({"é": 1.5}, *arrays))
    assert header["é"] == 1.5
    for array, other in zip(arrays, found, strict=True):
        np.testing.assert_array_equal(array, other)


def test_three_equal_channels_are_one():
    light = np.repeat(np.random.default_rng(0).random((*PROJECTOR, 1)), 3, axis=2)
    _, found = unpack_light(message(light), PROJECTOR)
    assert found.is_grey
    np.testing.assert_allclose(found.as_array(), light[..., 0], atol=1e-5)
    _, found = unpack_light(message(light, colour=[1, 0.5, 0]), PROJECTOR)
    np.testing.assert_allclose(found.as_array(), light * [1, 0.5, 0], atol=1e-5)


@pytest.mark.parametrize(
    ("listening", "words"),
    [
        (ListeningAddress("no.such.host.invalid", 0), "no address of this machine"),
        (ListeningAddress("8.8.8.8", 0), "no address of this machine"),
    ],
)
def test_addresses_that_cannot_be_listened_at(listening, words):
    with pytest.raises(InputError, match=words), serve(None, listening):
        pass


def test_the_command_serves_until_it_is_interrupted(stored):
    command = [sys.executable, "-m", "nearfar", "view", str(stored), "--port", "0", "--no-browser"]
    command += ["--beside", str(stored), "--capture", str(stored.parent / "capture.zarr")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        line = running.stdout.readline().decode()
        address = line.split(" at ")[1].split(",")[0]
        scene = json.loads(ask(address, "/scene"))
        assert scene["camera"] == list(CAMERA)
        assert scene["beside"]["name"] == stored.name
        assert "held-out" in [each["name"] for each in scene["maps"]]
        os.kill(running.pid, signal.SIGINT)
        rest, faults = running.communicate(timeout=LONGEST_WAIT)
    assert (running.returncode, rest.decode().strip(), faults) == (0, "view ended", b"")


def test_what_memory_would_hold_a_larger_transport_is_said(stored):
    command = [sys.executable, "-m", "nearfar", "view", str(stored), "--port", "0", "--no-browser"]
    with subprocess.Popen([*command, "--memory", "100kB"], stdout=subprocess.PIPE) as running:
        said = running.stdout.readline().decode()
        assert "is read again whenever the light comes to rest" in said
        assert "--memory 1GB keeps it in memory" in said
        assert " at http" in running.stdout.readline().decode()
        os.kill(running.pid, signal.SIGINT)
        running.communicate(timeout=LONGEST_WAIT)
    assert running.returncode == 0


def test_what_is_no_transport_gets_a_sentence(tmp_path):
    ran = run_nearfar("view", tmp_path / "none.zarr", "--no-browser")
    assert ran.status == 1
    assert "is not there" in ran.err
    with pytest.raises(MissingFileError):
        InteractiveTransport(tmp_path / "none.zarr")


def test_without_its_packages_there_is_a_sentence():
    assert "pip install 'nearfar[viewer]'" in said_without("fastapi", "import nearfar.viewer.view")


def test_what_lies_in_the_folder_is_not_run(address, tmp_path, monkeypatch):
    (tmp_path / "numpy.py").write_text("raise SystemExit('run')")
    monkeypatch.chdir(tmp_path)
    light = np.zeros(PROJECTOR, np.float32)
    unpack(ask(address, "/read/light?name=l.npy", encode_npy(light)))


def test_one_job_runs_at_a_time_even_if_its_page_is_gone(serve_it, lights, monkeypatch):
    import threading

    under, most, lock = 0, [], threading.Lock()
    relight_coarsely = InteractiveTransport.relight_coarsely

    def counted(self, *given):
        nonlocal under
        with lock:
            under += 1
            most.append(under)
        time.sleep(0.05)
        try:
            return relight_coarsely(self, *given)
        finally:
            with lock:
                under -= 1

    monkeypatch.setattr(InteractiveTransport, "relight_coarsely", counted)
    address = serve_it()
    for _ in range(20):
        with socket_of(address) as socket:
            socket.send(message(lights["spot"]))
    relit(address, lights["spot"])
    assert max(most) == 1


def test_too_many_requests_at_once_are_refused(serve_it, monkeypatch):
    from concurrent.futures import ThreadPoolExecutor

    from nearfar.viewer import jobs, payloads

    monkeypatch.setattr(jobs, "MAXIMUM_JOBS", 2)
    row_of, refused_one = payloads.transport_row, threading.Event()

    def held(*given):
        # Until another one is refused, on the busiest machine too.
        assert refused_one.wait(LONGEST_WAIT)
        return row_of(*given)

    monkeypatch.setattr(payloads, "transport_row", held)
    address = serve_it()

    def row(_):
        try:
            return 200 if ask(address, "/row?y=1&x=1") else 0
        except urllib.error.HTTPError as error:
            error.close()
            refused_one.set()
            return error.code

    with ThreadPoolExecutor(8) as pool:
        statuses = list(pool.map(row, range(8)))
    assert set(statuses) == {200, 503}
    assert statuses.count(200) >= 2


@pytest.mark.parametrize(("window", "k_near"), [(3, 1 / 3), (4, 0.5), (5, 0.4), (6, 0.5)])
def test_the_highest_near_frequency_is_that_of_the_papers_plan(window, k_near):
    world = model_transport(Size(12, 12), Size(3, 5), window=window, far=Size(3, 3))
    header = transport_row(of_rows(world, slice(1, 2)), 2).header
    assert header["k_near"] == pytest.approx([k_near, k_near])
    assert header["k_far"] == pytest.approx([1 / 12, 1 / 12])


def test_a_projector_of_one_row_is_shown(tmp_path):
    world = model_transport(Size(1, 24), Size(3, 5), window=3, far=Size(1, 3), entries=0)
    save_transport(replace(world, near=np.zeros_like(world.near)), tmp_path / "row.zarr")
    with served_view(InteractiveTransport(tmp_path / "row.zarr")) as address:
        header, _ = unpack(ask(address, "/map/row"))
        assert header["low"] < header["high"]
        header, (window, *_) = unpack(ask(address, "/row?y=1&x=2"))
        assert window.shape == (1, 24)
        assert header["k_near"][0] == 0
        assert header["k_far"][1] <= header["k_near"][1] <= 0.5


def test_a_camera_of_one_or_four_channels_is_shown(tmp_path):
    for channels, colours in ((1, 1), (2, 1), (4, 3)):
        world = model_transport(Size(8, 9), Size(5, 7), window=3, far=Size(3, 3), channels=channels)
        save_transport(world, tmp_path / f"{channels}.zarr")
        with served_view(InteractiveTransport(tmp_path / f"{channels}.zarr")) as address:
            light = np.random.default_rng(0).random((8, 9))
            _, parts = relit(address, light)
            assert parts.shape == (3, 5, 7, colours)
            whole = (world @ light).reshape(5, 7, channels)
            expected = whole[..., :3] if colours == 3 else whole.mean(axis=-1, keepdims=True)
            np.testing.assert_allclose(parts.astype(np.float32).sum(axis=0), expected, atol=1e-3)
