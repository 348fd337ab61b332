"""Pictures on the disk: photos and lights read exactly as stored, images written."""

import re
from pathlib import Path
from typing import Any

import imagecodecs
import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Size
from nearfar.errors import InputError, MissingFileError, UnreadableFileError
from nearfar.files import codecs
from nearfar.files.colour import from_srgb, to_srgb
from nearfar.files.output import new_output
from nearfar.files.raw import decode_raw
from nearfar.files.reading import reading_faults
from nearfar.files.unsupported import UnsupportedPictureError

PICTURE_ENDINGS = (".png", ".tif", ".tiff", ".bmp", ".exr", ".npy")
# The same in words.
PICTURE_KINDS = "PNG, TIFF, BMP, EXR or NPY"
IMAGE_ENDINGS = (".npy", ".exr", ".tiff", ".tif", ".png")
RAW_ENDINGS = (".dng", ".nef", ".cr2", ".cr3", ".arw", ".raf", ".orf", ".rw2", ".pef", ".raw")

JPEG_SIGNATURE = b"\xff\xd8\xff"

# A number in the middle of a name is compared as a number.
_DIGITS = re.compile(r"([0-9]+)")


def read_picture(path: Path) -> NDArray[Any]:
    """Read a picture as it is stored: PNG, TIFF, BMP, EXR or NPY, recognised by its first bytes.

    Camera raw files, recognised by their names, come as `nearfar.files.raw.decode_raw` gives them.

    Parameters
    ----------
    path : Path

    Returns
    -------
    array
        uint8, uint16 or float32, shape (y, x) or (y, x, 3). Alpha is dropped, palettes and
        grey of under 8 bits become 8 bits, other floats become float32.

    Raises
    ------
    MissingFileError
        If there is no such file.
    UnreadableFileError
        If the file is damaged, cut short, or of a kind that is not read.
    InputError
        If it holds NaN or infinities, or is no image of 8 or 16 bits or floats.
    MissingPackageError
        If it is a camera raw file and rawpy is not installed.
    """
    return decode_picture(_read_bytes(path), path)


def decode_picture(data: bytes, path: Path) -> NDArray[Any]:
    """Decode the bytes of a picture that `path` names; as `read_picture`."""
    if is_raw(path):
        return decode_raw(data, path).levels
    if data.startswith(JPEG_SIGNATURE):
        raise UnreadableFileError(
            f"{path} is a JPEG, which has 8 bits and is not linear: have the camera save raw "
            f"files, or give {PICTURE_KINDS}."
        )
    decoder = next((d for magic, d in codecs.DECODERS.items() if data.startswith(magic)), None)
    if decoder is None:
        what = "is no picture that can be read" if data else "is empty"
        if (kind := codecs.other_kind(data)) is not None:
            what = f"is a picture of the kind {kind}, which is not read"
        raise UnreadableFileError(f"{path} {what}: give a {PICTURE_KINDS} file.")
    try:
        pixels = decoder(data)
    except UnsupportedPictureError as error:
        raise UnreadableFileError(f"{path} {error}.") from None
    except codecs.DAMAGE as error:
        raise UnreadableFileError(
            f"{path} is damaged or cut short: copy or save it again."
        ) from error
    return _checked(path, pixels)


def decode_jpeg(data: bytes, path: Path) -> NDArray[np.uint8]:
    """Decode the bytes of a JPEG, whose levels are those of a screen, not the light's.

    Raises
    ------
    UnreadableFileError
        If it is damaged.
    """
    try:
        return np.asarray(imagecodecs.jpeg8_decode(data), dtype=np.uint8)
    except (imagecodecs.Jpeg8Error, ValueError, RuntimeError):
        raise UnreadableFileError(
            f"{path} is a damaged JPEG: copy, take or save it again."
        ) from None


def is_raw(path: Path) -> bool:
    """Return whether a name is a camera raw file's; its first bytes do not always say so."""
    return path.suffix.lower() in RAW_ENDINGS


def _read_bytes(path: Path) -> bytes:
    with reading_faults(path):
        return path.read_bytes()


def _checked(path: Path, pixels: NDArray[Any]) -> NDArray[Any]:
    if pixels.ndim == 3 and pixels.shape[2] == 1:
        pixels = pixels[..., 0]
    pixels = np.ascontiguousarray(pixels, dtype=pixels.dtype.newbyteorder("="))
    if pixels.size == 0 or pixels.ndim not in {2, 3} or pixels.shape[2:] not in {(), (3,)}:
        shape = " x ".join(str(side) for side in pixels.shape)
        raise InputError(
            f"{path} has the shape {shape or 'of a single number'}: an image is "
            f"height x width, or height x width x 3."
        )
    if pixels.dtype.kind == "f":
        with np.errstate(over="ignore"):
            pixels = pixels.astype(np.float32)
        require_finite(pixels, str(path))
    elif pixels.dtype not in (np.uint8, np.uint16):
        raise InputError(
            f"{path} holds {pixels.dtype} numbers: save it as uint8, uint16 or float32."
        )
    return pixels


def full_scale_of_file(path: Path) -> float | None:
    """Read the level of full white from a camera raw file; None for other files."""
    return decode_raw(_read_bytes(path), path).white if is_raw(path) else None


def require_finite(pixels: NDArray[Any], name: str) -> None:
    """Refuse NaN and infinities.

    Raises
    ------
    InputError
        With the count of bad values.
    """
    bad = pixels.size - np.count_nonzero(np.isfinite(pixels))
    if bad:
        raise InputError(
            f"{name} has {bad} values of {pixels.size} that are NaN or infinite: "
            f"replace them by numbers."
        )


def full_scale_of(dtype: np.dtype[Any]) -> float:
    """Value of full white: 255, 65535, or 1.0 for floats."""
    return 1.0 if dtype.kind == "f" else float(np.iinfo(dtype).max)


def read_linear(path: Path, *, full_scale: float | None = None) -> NDArray[np.float32]:
    """Read a picture as linear light, full scale = 1.

    Parameters
    ----------
    path : Path
    full_scale : float, optional
        Stored value of full scale; by default that of the numbers' type.

    Returns
    -------
    array
        float32, shape (y, x) or (y, x, 3).

    Raises
    ------
    MissingFileError, UnreadableFileError, InputError
        As `read_picture`.
    """
    pixels = read_picture(path)
    if full_scale is None:
        full_scale = full_scale_of_file(path)
    scale = full_scale_of(pixels.dtype) if full_scale is None else full_scale
    return np.asarray(pixels.astype(np.float32) / np.float32(scale))


def read_light(path: Path, projector: Size, *, srgb: bool = False) -> NDArray[np.float32]:
    """Read a light: what the projector shows, linear, full white = 1.

    Parameters
    ----------
    path : str or Path
    projector : Size
        Size that the light must have.
    srgb : bool
        The file is an ordinary sRGB picture of 8 or 16 bits; a JPEG is nothing else.

    Returns
    -------
    array
        float32, shape (Py, Px) or (Py, Px, 3).

    Raises
    ------
    MissingFileError, UnreadableFileError, InputError
        As `read_picture`; also if the size is not the projector's, or floats are called sRGB.
    """
    return light_of_size(read_light_of_any_size(path, srgb=srgb), path, projector)


def read_light_of_any_size(path: Path, *, srgb: bool = False) -> NDArray[np.float32]:
    """Read a light that may have another size than the projector; see `read_light`.

    Returns
    -------
    array
        float32, shape (height, width) or (height, width, 3).
    """
    data = _read_bytes(path)
    if not data.startswith(JPEG_SIGNATURE):
        pixels = decode_picture(data, path)
    elif srgb:
        pixels = _checked(path, decode_jpeg(data, path))
    else:
        raise InputError(
            f"{path} is a JPEG, an ordinary sRGB picture and not linear: say so by `srgb`, or give "
            f"linear light as {PICTURE_KINDS}."
        )
    if srgb and pixels.dtype.kind == "f":
        raise InputError(f"{path} holds floats, which are linear light: leave out `srgb`.")
    light = pixels.astype(np.float32) / np.float32(full_scale_of(pixels.dtype))
    return from_srgb(light) if srgb else light


def light_of_size(
    light: NDArray[np.float32], path: Path, projector: Size, *, other_cure: str = ""
) -> NDArray[np.float32]:
    """Return a light that was read from a file, if it has the projector's size.

    Parameters
    ----------
    light : array
    path : Path
        The file, for the message.
    projector : Size
    other_cure : str, optional
        What the message ends with beside a light of the projector's size.

    Raises
    ------
    InputError
        If it has another.
    """
    size = Size(*light.shape[:2])
    if size != projector:
        raise InputError(
            f"{path} is {size} but the projector is {projector} (height x width): give a light of "
            f"{projector}{other_cure}."
        )
    return light


def check_picture_ending(path: Path) -> None:
    """Refuse an output whose ending names no picture that can be written.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in IMAGE_ENDINGS:
        raise InputError(
            f"{path} does not end in {', '.join(IMAGE_ENDINGS[:-1])} or {IMAGE_ENDINGS[-1]}: "
            f"choose one of these endings."
        )


def write_picture(
    path: Path, image: NDArray[np.float32], *, force: bool = False, may_be_infinite: bool = False
) -> None:
    """Write an image by the ending of its name, whole or not at all.

    Parameters
    ----------
    path : Path
        ``.npy``, ``.exr``, ``.tiff`` and ``.tif`` keep float32 exactly; ``.png`` is 8-bit sRGB,
        clipped to [0, 1], for looking.
    image : array
        Linear light, shape (y, x) or (y, x, 3); for ``.npy`` any number of channels.
    force : bool
        Replace a file that is there.
    may_be_infinite : bool
        Whether values may be infinite, as standard deviations of what is not known are; white in a
        ``.png``.

    Raises
    ------
    InputError
        For another ending or shape, NaN, or infinities that are not allowed.
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.output.new_output`.
    """
    check_picture_ending(path)
    image = np.asarray(image, dtype=np.float32)
    if image.ndim == 3 and image.shape[2] == 1:
        image = image[..., 0]
    any_channels = path.suffix.lower() == ".npy"
    if image.ndim not in {2, 3} or not (any_channels or image.shape[2:] in {(), (3,)}):
        raise InputError(
            f"the image for {path} has the shape {image.shape}: give (y, x) or (y, x, 3), or "
            f"choose a name that ends in .npy, which holds any number of channels."
        )
    known = np.where(np.isposinf(image), 0, image) if may_be_infinite else image
    require_finite(known, f"the image for {path}")
    with new_output(path, force=force) as partial:
        partial.write_bytes(_encode(path.suffix.lower(), image))


def write_light(path: Path, light: NDArray[np.float32], *, force: bool = False) -> None:
    """Write a light by the ending of its name, whole or not at all, as `read_light` reads it.

    Parameters
    ----------
    path : Path
        ``.npy``, ``.exr``, ``.tiff`` and ``.tif`` keep float32 exactly; ``.png`` has 16 bits of
        linear light.
    light : array
        0 to 1, shape (y, x) or (y, x, 3).
    force : bool
        Replace a file that is there.

    Raises
    ------
    NearfarError
        As `write_picture`.
    """
    if path.suffix.lower() != ".png":
        write_picture(path, light, force=force)
        return
    require_finite(light, f"the light for {path}")
    levels = np.rint(65535.0 * np.clip(light, 0, 1)).astype(np.uint16)
    with new_output(path, force=force) as partial:
        partial.write_bytes(codecs.encode_png(levels))


def _encode(ending: str, image: NDArray[np.float32]) -> bytes:
    if ending == ".npy":
        return codecs.encode_npy(image)
    if ending == ".exr":
        return codecs.encode_exr(image)
    if ending == ".png":
        return codecs.encode_png(np.rint(255.0 * to_srgb(np.clip(image, 0, 1))).astype(np.uint8))
    return codecs.encode_tiff(image)


def natural_key(path: Path) -> tuple[tuple[str | int, ...], str]:
    """Key to sort by so that img9 comes before img10."""
    parts = _DIGITS.split(path.name.casefold())
    return tuple(int(p) if i % 2 else p for i, p in enumerate(parts)), path.name


def list_pictures(folder: Path) -> list[Path]:
    """Picture files in a folder, in natural order; hidden files and others are left out.

    Raises
    ------
    MissingFileError, UnreadableFileError
        If the folder is not there, or cannot be read.
    """
    try:
        entries = list(folder.iterdir())
    except FileNotFoundError:
        raise MissingFileError(f"{folder} is not there: check the name of the folder.") from None
    except OSError as error:
        raise UnreadableFileError(
            f"{folder} cannot be read as a folder ({error.strerror}): give a folder of pictures."
        ) from error
    pictures = (
        entry
        for entry in entries
        if entry.suffix.lower() in (*PICTURE_ENDINGS, *RAW_ENDINGS)
        and not entry.name.startswith(".")
        and not entry.is_dir()
    )
    return sorted(pictures, key=natural_key)
