"""What the viewer's page is answered, as bytes; none of it knows how it is asked for."""

from collections.abc import Callable, Iterable, Mapping
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nearfar.errors import InputError
from nearfar.files import from_srgb, full_scale_of
from nearfar.files.codecs import encode_exr
from nearfar.markup import SCALE
from nearfar.release import version
from nearfar.report.maps import TITLES, Map, map_named
from nearfar.report.page import STYLE
from nearfar.viewer.decoding import decode_apart
from nearfar.viewer.inspecting import inspect_row
from nearfar.viewer.messages import WHITE, Gains, Light, pack
from nearfar.viewer.viewed import ViewedTransport, in_half


def read_asset(name: str) -> bytes:
    """Read one of the files that the page is made of."""
    text = (files("nearfar.viewer") / "page" / name).read_text(encoding="utf-8")
    return (STYLE + text if name == "style.css" else text).encode()


def tell_scene(viewed: ViewedTransport, maps: Iterable[str]) -> dict[str, Any]:
    """Tell the page what it shows."""
    stored = viewed.stored
    plan = stored.provenance.get("plan")
    return {
        "name": viewed.path.name,
        "nearfar": version(),
        "projector": list(stored.projector),
        "camera": list(stored.camera),
        "channels": stored.channels,
        "window": viewed.quick.window,
        "method": stored.provenance.get("method"),
        "plan": plan if isinstance(plan, dict) else None,
        "maps": [{"name": name, "title": TITLES[name]} for name in maps],
        "scale": SCALE.tolist(),
    }


def answer_row(viewed: ViewedTransport, y: int, x: int) -> bytes:
    """Pack what a camera pixel sees of each projector pixel."""
    found = inspect_row(viewed.row_of_camera(y), x)
    return pack({"y": y, "x": x, **found.words}, *found[1:])


def answer_column(viewed: ViewedTransport, y: int, x: int) -> bytes:
    """Pack what a projector pixel lights, on average over channels."""
    answered = viewed.quick.column(y, x).reshape(*viewed.quick.camera, -1).mean(axis=-1)
    return pack({"y": y, "x": x, "step": viewed.step}, answered.astype(np.float32))


def answer_map(maps: Mapping[str, Callable[[], Map]], name: str) -> bytes:
    """Pack a map with its scale; raises as `nearfar.report.maps.map_named`."""
    found = map_named(maps, name)
    words = {name: getattr(found, name) for name in ("title", "unit", "low", "high")}
    return pack(words, np.asarray(found.values, dtype=np.float32))


def answer_exr(viewed: ViewedTransport, light: Light, gains: Gains) -> bytes:
    """Encode the picture under a light, every camera pixel of it, as OpenEXR."""
    picture = viewed.relight(light, **gains.model_dump())
    return encode_exr(viewed.in_colours(picture.reshape(*picture.shape[:2], -1)).squeeze())


def read_light_file(viewed: ViewedTransport, data: bytes, name: str) -> bytes:
    """Read a light of the pattern grid's size, linear, and pack it.

    Raises
    ------
    UnreadableFileError, InputError
        If it is no picture, or of another size.
    """
    pixels = decode_apart(data, name, viewed.projector)
    light = pixels.astype(np.float32) / np.float32(full_scale_of(pixels.dtype))
    if light.min() < 0 or light.max() > 1:
        raise InputError(
            f"the light goes from {light.min():.4g} to {light.max():.4g}, and a projector shows 0 "
            f"to 1: scale it."
        )
    levels = np.rint(_coloured(light) * np.float32(WHITE)).astype(np.uint16)
    return pack({}, levels)


def read_photo_file(viewed: ViewedTransport, data: bytes, name: str) -> bytes:
    """Read a photo to compare with: photo units, less the black that was measured; pack it.

    Of eight bits it is a picture for looking, unless the capture's photos are such.

    Raises
    ------
    UnreadableFileError, InputError
        If it is no picture, or not of the camera's size.
    """
    pixels = decode_apart(data, name, viewed.stored.camera)
    taken = viewed.stored.provenance.get("photos")
    photo = pixels.astype(np.float32)
    if isinstance(taken, dict) and taken.get("dtype") == str(pixels.dtype):
        photo /= np.float32(taken["full_scale"])
        is_linear = True
    else:
        photo /= np.float32(full_scale_of(pixels.dtype))
        is_linear = pixels.dtype != np.uint8
    if is_linear:
        photo = _coloured(photo) - viewed.in_colours(viewed.stored.black())
    else:
        photo = _coloured(from_srgb(photo))
    scale, shown = in_half(viewed.thinned_out(photo))
    return pack({"scale": scale}, shown)


# What a page may send to be read.
READERS: dict[str, Callable[[ViewedTransport, bytes, str], bytes]] = {
    "light": read_light_file,
    "photo": read_photo_file,
}


def _coloured(picture: NDArray[Any]) -> NDArray[Any]:
    """Give a picture three colours."""
    if picture.ndim == 2:
        picture = picture[..., None]
    return np.broadcast_to(picture, (*picture.shape[:2], 3))
