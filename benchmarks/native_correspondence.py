"""Correspondence by phase at a projector's own pixels, against the truth.

Run ``python benchmarks/native_correspondence.py [HxW ...]``, by default for four projectors. The
camera sees the curved surfaces of `tests.correspondence.lit_surface`. For each projector, width of
footprints, share of direct light and noise it prints the median and the 99th percentile of the
distance between q and the truth in projector pixels, in percent how many lit camera pixels are
more than a pixel off or missed and how many in the shadow are found, and the microseconds of
processor time that a camera pixel takes.
"""

import sys
import time

import numpy as np
from tests.correspondence.lit_surface import lit_surface

from nearfar import Size
from nearfar.arrays import parse_size
from nearfar.correspondence import correspond_by_phase

PROJECTORS = (Size(256, 256), Size(512, 512), Size(1080, 1920), Size(2160, 3840))
CAMERA = Size(80, 96)
# Widest footprints of a mixture, as a share of the projector's longer side, and in pixels.
WIDEST_SHARE, WIDEST = 0.006, 8.0
# Widths that all camera pixels share, shares of direct light, and noise as shares of white.
WIDTHS = (0.5, 1.0, 2.0, 4.0, 8.0)
DIRECT = (0.1, 0.15, 0.3)
NOISE = (0.003, 0.03, 0.1)


def report(label: str, projector: Size, footprint: tuple[float, float], **options: object) -> None:
    """Print a row of the table."""
    world = lit_surface(projector, CAMERA, footprint=footprint, **options)
    # Filters are built once for all tiles.
    correspond_by_phase(world.measurements, pitch=1)
    started = time.process_time()
    found = correspond_by_phase(world.measurements, pitch=1)
    seconds = time.process_time() - started
    off = np.hypot(*np.moveaxis(found.q - world.q, -1, 0))
    seen = off[world.lit & found.lit]
    middle, most = np.percentile(seen, [50, 99]) if len(seen) else (np.nan, np.nan)
    missed, in_shadow = np.mean(~found.lit[world.lit]), np.mean(found.lit[~world.lit])
    shares = (np.sum(seen > 1) / max(1, len(seen)), missed, in_shadow)
    print(
        f"  {label:<28}{middle:8.3f}{most:8.3f}{''.join(f'{share:9.2%}' for share in shares)}"
        f"{seconds / CAMERA.pixels * 1e6:8.0f}",
        flush=True,
    )


def run(projector: Size) -> None:
    """Print the table of a projector."""
    print(f"projector {projector}, camera {CAMERA}")
    titles = ("off > 1", "missed", "shadow")
    print(f"  {'':<28}{'median':>8}{'99 %':>8}{''.join(f'{t:>9}' for t in titles)}{'us':>8}")
    mixture = (0.5, min(WIDEST, WIDEST_SHARE * max(projector)))
    report(f"footprints 0.5 to {mixture[1]:.1f}", projector, mixture)
    for width in WIDTHS:
        if width <= mixture[1]:
            report(f"footprints {width}", projector, (width, width))
    narrow = (0.5, min(2.0, mixture[1]))
    for share in DIRECT:
        report(f"direct light {share}", projector, narrow, direct=(share, share))
    for noise in NOISE:
        report(f"noise {noise}", projector, narrow, noise=noise)


if __name__ == "__main__":
    for size in [parse_size(text) for text in sys.argv[1:]] or PROJECTORS:
        run(size)
