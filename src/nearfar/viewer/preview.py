"""``nearfar preview``: the camera's picture live in the browser, to set aim, focus and exposure."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from nearfar.arrays import Size
from nearfar.errors import DeviceError, InputError
from nearfar.packages import needed
from nearfar.rigs.real.rig import RealRig
from nearfar.viewer.assets import read_page, with_security_headers
from nearfar.viewer.photo_statistics import encode_for_display, photo_statistics
from nearfar.viewer.server import LOOPBACK, ListeningAddress, serve

# The squares of the pattern to focus on, in projector pixels.
SQUARE_SIDE = 16
# Leaves time to the browser if the camera is quick.
PAUSE_SECONDS = 0.05
PAUSE_AFTER_FAULT_SECONDS = 1.0

Pattern = Literal["white", "black", "grey", "squares"]
LEVELS = {"white": 255, "black": 0, "grey": 128}


class Settings(BaseModel):
    """Settings that the browser asks to change; those left out stay as they are.

    Attributes
    ----------
    pattern : {"white", "black", "grey", "squares"}, optional
    exposure : float, optional
        Seconds.
    automatic : bool
        Whether to choose the exposure for the pattern that is projected.
    stop : bool
        Whether to end the preview.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    pattern: Pattern | None = None
    exposure: float | None = Field(default=None, gt=0.0)
    automatic: bool = False
    stop: bool = False


@dataclass
class _Exchange:
    """Data that the camera's thread and the server's threads exchange.

    Attributes
    ----------
    lock : Lock
        Protects the rest.
    jpeg : bytes
        The newest photo.
    state : dict
        The newest photo's number and statistics, the rig's settings, and the newest fault.
    settings : Settings
        Changes that the camera's thread has not made yet.
    """

    lock: threading.Lock = field(default_factory=threading.Lock)
    jpeg: bytes = b""
    state: dict[str, Any] = field(default_factory=lambda: {"number": 0, "fault": ""})
    settings: Settings = field(default_factory=Settings)

    def request(self, settings: Settings) -> None:
        """Add changes to those that wait."""
        changes = settings.model_dump(exclude_unset=True)
        with self.lock:
            self.settings = self.settings.model_copy(update=changes)

    def take_settings(self) -> Settings:
        """Return the changes that wait, and forget them."""
        with self.lock:
            settings, self.settings = self.settings, Settings()
        return settings

    def publish(self, jpeg: bytes | None, **state: Any) -> None:
        """Update the state, and the photo if there is a new one."""
        with self.lock:
            if jpeg is not None:
                self.jpeg = jpeg
                state["number"] = self.state["number"] + 1
            self.state = {**self.state, **state}


def run_preview(rig: RealRig, port: int, on_start: Callable[[str], object] | None = None) -> None:
    """Show the camera's picture until the browser, Esc or an interrupt ends it.

    Parameters
    ----------
    rig : RealRig
        With a pattern grid of the projector's own pixels.
    port : int
        0 for any that is free. Only this machine is served.
    on_start : callable, optional
        Called with the URL to open.

    Raises
    ------
    MissingPackageError
        If the server's packages are not installed.
    InputError
        If the server cannot listen on the port.
    KeyboardInterrupt
        If Esc was pressed.
    """
    exchange = _Exchange()
    with serve(_application(exchange), ListeningAddress(LOOPBACK, port)) as url:
        if on_start is not None:
            on_start(url)
        pattern: Pattern = "white"
        refusal = ""
        while not (settings := exchange.take_settings()).stop:
            pattern = settings.pattern or pattern
            pixels = _draw(pattern, rig.projector)
            try:
                if settings.model_fields_set:
                    # Displayed until the next change, or nobody could read it.
                    refusal = _set_exposure(rig, pixels, settings)
                photo = rig.photograph(pixels)
            except DeviceError as error:
                exchange.publish(None, fault=str(error))
                rig.wait(PAUSE_AFTER_FAULT_SECONDS)
                continue
            exchange.publish(
                encode_for_display(photo, rig.full_scale),
                **photo_statistics(photo, rig.full_scale)._asdict(),
                fault=refusal,
                pattern=pattern,
                exposure=rig.camera.exposure,
                limits=rig.camera.exposure_limits,
                camera=rig.camera.name,
                monitor=str(rig.monitor),
                size=str(Size(*photo.shape[:2])),
                channels=photo.shape[2],
            )
            rig.wait(PAUSE_SECONDS)


def _set_exposure(rig: RealRig, pixels: NDArray[np.uint8], settings: Settings) -> str:
    """Set the exposure that the settings ask for; return why that failed, or an empty string."""
    try:
        if settings.automatic:
            rig.photograph(pixels)
            rig.camera.expose_for_light(rig.whole_refreshes)
        elif settings.exposure is not None:
            rig.camera.set_exposure(rig.whole_refreshes(settings.exposure))
    except (InputError, DeviceError) as error:
        return str(error)
    return ""


def _draw(pattern: Pattern, size: Size) -> NDArray[np.uint8]:
    if pattern != "squares":
        return np.full(size, LEVELS[pattern], dtype=np.uint8)
    y, x = np.indices(size) // SQUARE_SIDE
    return (255 * ((x + y) % 2)).astype(np.uint8)


def _application(exchange: _Exchange) -> Any:
    with needed(extra="viewer", what="a page in the browser"):
        from fastapi import FastAPI
        from fastapi.responses import Response
    application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    application.add_middleware(with_security_headers)
    assets = read_page("preview")

    @application.get("/state")
    def state() -> dict[str, Any]:
        with exchange.lock:
            return dict(exchange.state)

    @application.get("/photo.jpg")
    def photo() -> Response:
        with exchange.lock:
            jpeg = exchange.jpeg
        return Response(jpeg, media_type="image/jpeg") if jpeg else Response(status_code=404)

    @application.post("/settings")
    def settings(changes: Settings) -> dict[str, bool]:
        exchange.request(changes)
        return {"accepted": True}

    @application.get("/{name}")
    def asset(name: str) -> Response:
        file = assets.get(name)
        if file is None:
            return Response("There is no such page.", 404, media_type="text/plain")
        return Response(file.content, media_type=file.media_type)

    @application.get("/")
    def index() -> Response:
        return asset("index.html")

    return application
