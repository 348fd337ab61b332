"""The content of the viewer's responses, independent of HTTP."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats
from nearfar.errors import InputError
from nearfar.files import from_srgb, full_scale_of
from nearfar.files.codecs import encode_exr
from nearfar.markup import MARK
from nearfar.release import version
from nearfar.report.maps import Map, map_named
from nearfar.transport.gains import why_unjudgeable
from nearfar.viewer.beside import Beside
from nearfar.viewer.colour_maps import describe_colour_maps
from nearfar.viewer.decoding import decode_in_process
from nearfar.viewer.interactive import InteractiveTransport, to_float16
from nearfar.viewer.messages import WHITE_LEVEL, Gains, Light, pack
from nearfar.viewer.transport_row import transport_row


class ProjectorLink(NamedTuple):
    """The page of a projector, from that of another one or of its own.

    Attributes
    ----------
    name : str
        Its transport.
    path : str
        Relative; empty for the page itself.
    """

    name: str
    path: str


def describe_scene(
    transport: InteractiveTransport,
    maps: Mapping[str, str],
    beside: Beside | None = None,
    projectors: Sequence[ProjectorLink] = (),
) -> dict[str, Any]:
    """Return a transport's verdict and sizes, its plan and what there is of it, for JSON.

    Parameters
    ----------
    transport : InteractiveTransport
    maps : mapping of str to str
        Titles of the maps there are, by name.
    beside : Beside, optional
        The second transport.
    projectors : sequence of ProjectorLink
        Pages of all projectors before the camera; empty for one alone.
    """
    stored, verdict = transport.stored, transport.stored.verdict
    plan = stored.provenance.get("plan")
    return {
        "name": transport.path.name,
        "verdict": verdict
        and {
            "grade": verdict.grade,
            "summary": verdict.summary,
            "reasons": list(verdict.sentences),
        },
        "unjudgeable": why_unjudgeable(stored.provenance),
        "nearfar": version(),
        "projector": list(stored.projector),
        "camera": list(stored.camera),
        "channels": stored.channels,
        "light_block": transport.light_block,
        "parts": list(stored.parts),
        "directions": _directions(stored.provenance, stored.projector.pixels),
        "window": transport.coarse.window,
        "pitch": transport.coarse.pitch,
        "method": stored.provenance.get("method"),
        "plan": plan if isinstance(plan, dict) else None,
        "maps": [{"name": name, "title": title} for name, title in maps.items()],
        "has_error_bars": stored.has_error_bars,
        "beside": beside
        and {"name": beside.name, "remark": beside.remark, "is_apart": beside.is_apart},
        "projectors": [link._asdict() for link in projectors],
        "colour_maps": describe_colour_maps(),
        "mark": list(MARK),
    }


def _directions(provenance: Mapping[str, Any], lamps: int) -> list[list[float]] | None:
    """Return the directions to the lamps of a light stage; None where they are not known."""
    try:
        found = np.array(provenance.get("directions"), dtype=np.float64)
    except (TypeError, ValueError):
        return None
    if found.shape != (lamps, 3) or not np.isfinite(found).all():
        return None
    directions: list[list[float]] = found.tolist()
    return directions


def pack_row(transport: InteractiveTransport, y: int, x: int) -> bytes:
    """Pack the row of the transport of one camera pixel."""
    row = transport_row(transport.camera_row(y), x)
    return pack({"y": y, "x": x, **row.header}, *row[1:])


def pack_column(transport: InteractiveTransport, y: int, x: int) -> bytes:
    """Pack the column of the transport of one projector pixel, averaged over channels."""
    coarse = transport.coarse
    column = coarse.column(y, x).reshape(*coarse.camera, -1).mean(axis=-1)
    return pack({"y": y, "x": x, "stride": transport.coarse_stride}, column.astype(np.float32))


def pack_map(maps: Mapping[str, Callable[[], Map]], name: str) -> bytes:
    """Compute and pack a map; raises as `nearfar.report.maps.map_named`."""
    found = map_named(maps, name)
    header = {name: getattr(found, name) for name in ("title", "unit", "low", "high", "reading")}
    values = np.asarray(found.values, dtype=np.float32)
    saturated = np.zeros(values.shape, bool) if found.saturated is None else found.saturated
    return pack(header, values, saturated.astype(np.uint8))


def encode_relit_exr(
    transport: InteractiveTransport,
    relight: Callable[[Light, Gains], Floats],
    light: Light,
    gains: Gains,
) -> bytes:
    """Relight every camera pixel by `relight` and encode the picture as OpenEXR."""
    picture = relight(light, gains)
    return encode_exr(transport.to_colours(picture.reshape(*picture.shape[:2], -1)).squeeze())


def read_light_file(transport: InteractiveTransport, data: bytes, name: str) -> bytes:
    """Decode a linear light of the pattern grid's size, and pack it.

    Raises
    ------
    UnreadableFileError, InputError
        If it is no picture, has another size, or values below 0 or above 1.
    """
    pixels = decode_in_process(data, name, transport.projector)
    light = pixels.astype(np.float32) / np.float32(full_scale_of(pixels.dtype))
    if light.min() < 0 or light.max() > 1:
        raise InputError(
            f"the light goes from {light.min():.4g} to {light.max():.4g}, and a projector shows 0 "
            f"to 1: scale it."
        )
    levels = np.rint(_to_rgb(light) * np.float32(WHITE_LEVEL)).astype(np.uint16)
    return pack({}, levels)


def read_photo_file(transport: InteractiveTransport, data: bytes, name: str) -> bytes:
    """Decode a photo to compare with, subtract the measured black, and pack it in photo units.

    8-bit pictures count as sRGB without black, unless the photos of the capture have 8 bits.

    Raises
    ------
    UnreadableFileError, InputError
        If it is no picture, or has another size than the camera.
    """
    pixels = decode_in_process(data, name, transport.stored.camera)
    captured = transport.stored.provenance.get("photos")
    photo = pixels.astype(np.float32)
    if isinstance(captured, dict) and captured.get("dtype") == str(pixels.dtype):
        photo /= np.float32(captured["full_scale"])
        is_linear = True
    else:
        photo /= np.float32(full_scale_of(pixels.dtype))
        is_linear = pixels.dtype != np.uint8
    if is_linear:
        photo = _to_rgb(photo) - transport.to_colours(transport.stored.black())
    else:
        photo = _to_rgb(from_srgb(photo))
    scale, halves = to_float16(transport.at_display_stride(photo))
    return pack({"scale": scale}, halves)


def read_wanted_file(transport: InteractiveTransport, data: bytes, name: str) -> bytes:
    """Decode a linear picture that the scene is to look like, and pack it, 1 for its brightest.

    Raises
    ------
    UnreadableFileError, InputError
        If it is no picture, has another size than the camera, or is negative or black.
    """
    wanted = decode_in_process(data, name, transport.stored.camera).astype(np.float32)
    if not (wanted.min() >= 0 and 0 < wanted.max() < np.inf):
        raise InputError(
            f"the wanted picture goes from {wanted.min():.4g} to {wanted.max():.4g}: give one "
            f"without negative light that is not black."
        )
    levels = np.rint(_to_rgb(wanted / wanted.max()) * np.float32(WHITE_LEVEL)).astype(np.uint16)
    return pack({}, levels)


# Readers of uploaded files by the kind that a page asks for.
FILE_READERS: dict[str, Callable[[InteractiveTransport, bytes, str], bytes]] = {
    "light": read_light_file,
    "photo": read_photo_file,
    "wanted": read_wanted_file,
}


def _to_rgb(picture: NDArray[Any]) -> NDArray[Any]:
    """Repeat a grey picture for red, green and blue, (y, x, 3)."""
    if picture.ndim == 2:
        picture = picture[..., None]
    return np.broadcast_to(picture, (*picture.shape[:2], 3))
