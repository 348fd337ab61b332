"""``nearfar preview``: what the camera sees, live in the browser, to aim, focus and expose by."""

import threading
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from nearfar.arrays import Size
from nearfar.errors import DeviceError, InputError
from nearfar.packages import needed
from nearfar.rigs.real.rig import RealRig
from nearfar.viewer.preview_page import PAGE
from nearfar.viewer.serving import HERE, Place, serve
from nearfar.viewer.sight import look, picture

# Side of the squares that are focused on, in the projector's pixels.
SQUARE = 16
# Seconds between photos, so that a camera that is quick leaves the browser time.
PAUSE = 0.05

Pattern = Literal["white", "black", "grey", "squares"]


class Wish(BaseModel):
    """What the browser asks for; what is left out stays.

    Attributes
    ----------
    pattern : {"white", "black", "grey", "squares"}, optional
    exposure : float, optional
        Seconds.
    automatic : bool
        Choose the exposure by what is shown now.
    stop : bool
        End the preview.
    """

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    pattern: Pattern | None = None
    exposure: float | None = Field(default=None, gt=0.0)
    automatic: bool = False
    stop: bool = False


@dataclass
class _Shared:
    """What the camera's thread and the server's tell each other."""

    lock: threading.Lock = field(default_factory=threading.Lock)
    jpeg: bytes = b""
    state: dict[str, Any] = field(default_factory=lambda: {"number": 0, "fault": ""})
    wish: Wish = field(default_factory=Wish)

    def ask(self, wish: Wish) -> None:
        """Add a wish to those that wait."""
        given = wish.model_dump(exclude_unset=True)
        with self.lock:
            self.wish = self.wish.model_copy(update=given)

    def take(self) -> Wish:
        """Hand over the wishes that wait."""
        with self.lock:
            wish, self.wish = self.wish, Wish()
        return wish

    def tell(self, jpeg: bytes | None, **state: Any) -> None:
        """Give the browser a photo, or what is to be known."""
        with self.lock:
            if jpeg is not None:
                self.jpeg = jpeg
                state["number"] = self.state["number"] + 1
            self.state = {**self.state, **state}


def run_preview(rig: RealRig, port: int, started: Any = None) -> None:
    """Show what the camera sees until the browser, Esc or an interrupt ends it.

    Parameters
    ----------
    rig : RealRig
        Of one pattern pixel for each of the projector's.
    port : int
        To serve on; 0 for any that is free. Only this machine is served.
    started : callable, optional
        Called with the address once it is served.

    Raises
    ------
    MissingPackageError
        If the server's packages are not installed.
    InputError
        If the port is taken.
    KeyboardInterrupt
        If Esc was pressed.
    """
    shared = _Shared()
    with serve(_application(shared), Place(HERE, port)) as address:
        if started is not None:
            started(address)
        pattern: Pattern = "white"
        while not (wish := shared.take()).stop:
            pattern = wish.pattern or pattern
            frame = _draw(pattern, rig.projector)
            try:
                fault = _expose(rig, frame, wish)
                photo = rig.photograph(frame)
            except DeviceError as error:
                shared.tell(None, fault=str(error))
                rig.wait(1.0)
                continue
            full = rig.full_scale
            shared.tell(
                picture(photo, full),
                **look(photo, full)._asdict(),
                fault=fault,
                pattern=pattern,
                exposure=rig.camera.exposure,
                limits=rig.camera.exposure_limits,
                camera=rig.camera.name,
                monitor=str(rig.monitor),
                size=str(Size(*photo.shape[:2])),
                channels=photo.shape[2],
            )
            rig.wait(PAUSE)


def _expose(rig: RealRig, frame: NDArray[np.uint8], wish: Wish) -> str:
    """Do what the wish says of the exposure; return why it cannot be done."""
    try:
        if wish.automatic:
            rig.photograph(frame)
            rig.camera.expose_for_light(rig.whole_refreshes)
        elif wish.exposure is not None:
            rig.camera.set_exposure(rig.whole_refreshes(wish.exposure))
    except (InputError, DeviceError) as error:
        return str(error)
    return ""


def _draw(pattern: Pattern, size: Size) -> NDArray[np.uint8]:
    if pattern != "squares":
        return np.full(size, {"white": 255, "black": 0, "grey": 128}[pattern], dtype=np.uint8)
    y, x = np.indices(size) // SQUARE
    return (255 * ((x + y) % 2)).astype(np.uint8)


def _application(shared: _Shared) -> Any:
    with needed(extra="viewer", what="a page in the browser"):
        from fastapi import FastAPI
        from fastapi.responses import HTMLResponse, Response
    application = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)

    @application.get("/")
    def page() -> HTMLResponse:
        return HTMLResponse(PAGE)

    @application.get("/state")
    def state() -> dict[str, Any]:
        with shared.lock:
            return dict(shared.state)

    @application.get("/photo.jpg")
    def photo() -> Response:
        with shared.lock:
            jpeg = shared.jpeg
        missing = Response(status_code=404)
        return Response(jpeg, media_type="image/jpeg") if jpeg else missing

    @application.post("/wish")
    def wish(wanted: Wish) -> dict[str, bool]:
        shared.ask(wanted)
        return {"heard": True}

    return application
