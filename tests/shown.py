"""Pictures of other people's patterns, and photos of them."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from nearfar.arrays import Floats, Size
from nearfar.capture import Capture, import_photos, open_capture, read_shown
from nearfar.files.codecs import encode_png
from nearfar.illumination import patterns
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene
from nearfar.transport.exact import ExactTransport


def as_picture(pattern):
    """Return a pattern in [0, 1] as 8 bits."""
    return np.rint(255 * np.asarray(pattern)).astype(np.uint8)


def with_inverses(pictures):
    """Return each picture followed by its inverse."""
    return [each for picture in pictures for each in (picture, 255 - picture)]


def gray_code(size: Size, axis: int):
    """Return the bits of the Gray code of rows or columns, the coarsest first."""
    draw, side = (patterns.gray_rows, patterns.gray_columns)[axis], size[axis]
    bits = range(patterns.gray_bits(side))
    return [as_picture(draw(bit, size)) for bit in reversed(bits)]


def fringes(size: Size, axis: int, periods, steps: int, power: float = 1.0):
    """Return fringes of some periods in pixels, with phases at equal steps."""
    place = np.indices(size)[axis]
    return [
        as_picture((0.5 + 0.5 * np.cos(2 * np.pi * (place / period + step / steps))) ** power)
        for period in periods
        for step in range(steps)
    ]


def micro_phase_shifting(size: Size, axis: int):
    """Return fringes whose periods are close together: three steps of one, one of the others."""
    first, *others = (16.0, 17.2, 18.5, 15.1, 14.3)
    return [
        *fringes(size, axis, [first], 3),
        *(fringes(size, axis, [period], 1)[0] for period in others),
    ]


def hadamard(size: Size):
    """Return the Hadamard patterns of Sylvester's matrix, white where it is 1."""
    pixels = np.arange(size.pixels, dtype=np.uint64)
    signs = np.bitwise_count(pixels[:, None] & pixels) & 1
    return [as_picture((row == 0).reshape(size)) for row in signs]


def random_binary(size: Size, count: int):
    """Return random patterns, half white."""
    generator = np.random.default_rng(3)
    return [as_picture(generator.random(size) < 0.5) for _ in range(count)]


def single_pixels(size: Size):
    """Return one white pixel at a time."""
    return [as_picture(pixel.reshape(size)) for pixel in np.eye(size.pixels)]


def white_and_black(size: Size):
    """Return white and black."""
    return [np.full(size, 255, np.uint8), np.zeros(size, np.uint8)]


def cornell(projector: Size, camera: Size) -> ExactTransport:
    """Return the box, nowhere brighter under white than 0.9 of the camera's full scale."""
    found = cached_scene("cornell", projector, camera)
    return found * (0.9 / (found @ np.ones(projector, dtype=np.float32)).max())


def photograph(world: ExactTransport, pictures, *, noise: bool = True) -> Iterator[Floats]:
    """Yield photos of pictures, 14 bits of a simulated camera with its black level."""
    camera, generator = SimulatedCamera(), np.random.default_rng(1)
    if not noise:
        camera = SimulatedCamera(read_noise=0.0, shot_noise=False, bits=16)
    for picture in pictures:
        light = np.asarray(picture, dtype=np.float32) / np.float32(255)
        yield camera.photograph(world @ light, generator)


def write_pictures(folder: Path, pictures, name="p") -> Path:
    """Write pictures as PNG files, numbered from 0."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, picture in enumerate(pictures):
        grey = picture[..., 0] if picture.shape[2:] == (1,) else picture
        (folder / f"{name}{number}.png").write_bytes(encode_png(grey))
    return folder


def captured(world: ExactTransport, pictures, folder: Path, *, shown=None, noise=True) -> Capture:
    """Return a capture of pictures, which were shown as others on a finer screen, perhaps."""
    patterns = write_pictures(folder / "patterns", pictures if shown is None else shown)
    taken = write_pictures(folder / "photos", photograph(world, pictures, noise=noise))
    found = read_shown(patterns)
    paths = [taken / f"p{number}.png" for number in range(len(pictures))]
    scale = 16383 if noise else 65535
    import_photos(found.plan, paths, folder / "c.zarr", full_scale=scale, shown=found)
    return open_capture(folder / "c.zarr")
