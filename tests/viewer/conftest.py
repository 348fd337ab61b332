"""A transport with error bars, and its page, served."""

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, sync_playwright

from nearfar.arrays import Size
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.transport.model import Transport
from nearfar.transport.store import load_transport, save_transport
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.server import ListeningAddress
from nearfar.viewer.view import run_view
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction.reconstruct import reconstruct
from tests.rigs.displays import need
from tests.viewer.asking import CAMERA, PROJECTOR
from tests.viewer.browsing import Pages
from tests.waiting import LONGEST_WAIT
from tests.worlds import model_transport

ANYWHERE = ListeningAddress("127.0.0.1", 0)


@pytest.fixture(scope="session")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A transport from noisy photos: 20x24 projector, 30x42 camera, three channels."""
    folder = tmp_path_factory.mktemp("viewer")
    world = model_transport(PROJECTOR, CAMERA, window=5, far=Size(3, 3), channels=3)
    plan, _ = choose_plan(PROJECTOR, 60)
    rig = SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
    capture = acquire(plan, folder / "capture.zarr", rig)
    transport, _ = reconstruct(capture)
    # A camera pixel without direct light, as every real scene has them.
    q = transport.correspondence.copy()
    q[3, 5] = np.nan
    direct, near = transport.direct.copy(), transport.near.copy()
    direct[3, 5] = near[3, 5] = 0
    path = folder / "a scene.zarr"
    save_transport(replace(transport, correspondence=q, direct=direct, near=near), path)
    return path


@pytest.fixture(scope="session")
def transport(stored: Path) -> Transport:
    return load_transport(stored)


@contextmanager
def served_view(
    transport: InteractiveTransport, listening: ListeningAddress = ANYWHERE, **shown: Any
) -> Iterator[str]:
    """Serve the page of a transport, and of a second one if given; yield its address."""
    ended, addresses = threading.Event(), []
    there = threading.Event()

    def started(address: str) -> None:
        addresses.append(address)
        there.set()

    thread = threading.Thread(
        target=run_view, args=(transport, listening, started, ended), kwargs=shown, daemon=True
    )
    thread.start()
    assert there.wait(LONGEST_WAIT)
    try:
        yield addresses[0]
    finally:
        ended.set()
        thread.join(timeout=LONGEST_WAIT)
        assert not thread.is_alive()


@pytest.fixture(scope="session")
def address(stored: Path) -> Iterator[str]:
    with served_view(InteractiveTransport(stored)) as here:
        yield here


@pytest.fixture
def serving() -> Iterator[ExitStack]:
    """Whatever serves pages of a test, ended after the pages are put back: they would miss it."""
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def serve(serving: ExitStack) -> Callable[..., str]:
    """Serve the page of a transport to the end of the test; returns its address."""

    def of(transport: InteractiveTransport, **shown: Any) -> str:
        return serving.enter_context(served_view(transport, **shown))

    return of


@pytest.fixture
def serve_it(stored: Path, serving: ExitStack) -> Callable[..., str]:
    """Serve it in other ways: with little memory, with all quick copies coarse, elsewhere."""

    def of(listening: ListeningAddress = ANYWHERE, memory: int = 10**9) -> str:
        transport = InteractiveTransport(stored, memory=memory)
        return serving.enter_context(served_view(transport, listening))

    return of


@pytest.fixture
def lights() -> dict[str, np.ndarray[Any, Any]]:
    """Return lights of the pattern grid's size."""
    generator = np.random.default_rng(0)
    spot = np.zeros(PROJECTOR)
    spot[4:9, 6:12] = 1
    return {
        "white": np.ones(PROJECTOR),
        "black": np.zeros(PROJECTOR),
        "spot": spot,
        "random": generator.random(PROJECTOR),
        "coloured": generator.random((*PROJECTOR, 3)),
    }


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Debian's Chromium."""
    need("chromium")
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(
            executable_path="/usr/bin/chromium", args=["--no-sandbox"]
        )
        yield running
        running.close()


@pytest.fixture(scope="module")
def pages(browser: Browser) -> Pages:
    return Pages(browser)


@pytest.fixture
def open_page(pages: Pages, serving: ExitStack) -> Iterator[Callable[..., Page]]:
    """Open the viewer's page; any output on its console is a failure.

    What serves it is asked for so that it ends later.
    """
    yield pages.open
    assert pages.put_back() == []
