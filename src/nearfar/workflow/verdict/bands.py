"""Bands of camera rows in which relit pictures are compared with photos."""

from nearfar.arrays import Size, blocks

# Camera pixels that are compared, about, in bands of this many rows.
CAMERA_PIXELS = 2**17
ROWS_PER_BAND = 8


def bands(camera: Size) -> list[slice]:
    """Return bands of rows of a camera, spread evenly, about `CAMERA_PIXELS` in all."""
    every = list(blocks(camera.height, ROWS_PER_BAND))
    step = max(1, round(camera.pixels / CAMERA_PIXELS))
    return every[step // 2 :: step] or every[:1]
