"""Stand in for a projector and a camera: photograph patterns in a simulated box.

Run ``python samples/shoot.py FOLDER ... [--camera HxW]``. The patterns are in FOLDER/patterns, and
their photos of 16 bits go into FOLDER/photos under the same names; 16383 is full scale. The scene
is nearfar's box with a cup and a candle, the camera a grey one with 30 000 electrons at full scale.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from nearfar.arrays import Floats, Size, parse_size
from nearfar.files import encode_png, full_scale_of, list_pictures, read_picture
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene

# Level of the brightest pixel of white, as a share of full scale.
BRIGHTEST = 0.8


def photograph(pictures: Sequence[Floats], camera: Size, seed: int = 0) -> list[NDArray[np.uint16]]:
    """Return a photo of each picture, (Cy, Cx): levels from 0, black, to 1, white."""
    world = cached_scene("cornell", Size(*pictures[0].shape), camera)
    white = (world @ np.ones_like(pictures[0])).mean(axis=-1).max()
    sensor, generator = SimulatedCamera(), np.random.default_rng(seed)
    photos = []
    for picture in pictures:
        light = (world @ picture.astype(np.float32)).mean(axis=-1, keepdims=True)
        photos.append(sensor.photograph(light * np.float32(BRIGHTEST / white), generator)[..., 0])
    return [photo.astype(np.uint16) for photo in photos]


def read_light(path: Path) -> Floats:
    """Return a picture's levels from 0 to 1."""
    picture = read_picture(path)
    return np.asarray(picture / np.float32(full_scale_of(picture.dtype)))


def main() -> None:
    """Photograph the patterns of some folders."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", type=Path, nargs="+", metavar="FOLDER")
    parser.add_argument("--camera", type=parse_size, default=Size(64, 64))
    given = parser.parse_args()
    for folder in given.folders:
        paths = list_pictures(folder / "patterns")
        photos = photograph([read_light(path) for path in paths], given.camera)
        (folder / "photos").mkdir()
        for path, photo in zip(paths, photos, strict=True):
            (folder / "photos" / f"{path.stem}.png").write_bytes(encode_png(photo))


if __name__ == "__main__":
    main()
