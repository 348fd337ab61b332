"""Direct-global separation from captures of any patterns against the truth of exact scenes.

Run ``python benchmarks/separation_any_patterns.py [SCENE ...] [--projector HxW]``. For each set of
patterns it prints how many photos were used of how many, and the SNR in dB of direct and global
under full white; then the same of nearfar's own patterns by ``nearfar separate --rig``. Photos are
of the noisy camera of 30 000 e- at full well and 14 bits, with its black level.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from tests.shown import (
    fringes,
    gray_code,
    hadamard,
    photograph,
    random_binary,
    white_and_black,
    with_inverses,
    write_pictures,
)

from nearfar import snr
from nearfar.arrays import Size, parse_size
from nearfar.baselines.separation import Separation
from nearfar.baselines.separation_methods import by_checkerboards, by_sinusoids
from nearfar.baselines.separation_patterns import checkerboards, sinusoids
from nearfar.baselines.separation_photos import separate, shoot_to_separate
from nearfar.capture import import_photos, pair, read_shown
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.cache import cached_scene
from nearfar.workflow.separate_capture import separate_capture

# Level of the brightest pixel of white, in photo units.
BRIGHTEST = 0.9


def shifted_checkerboards(size: Size, side: int, step: int, shifts: int) -> list[np.ndarray]:
    """Draw checkerboards as Nayar and others shift them: over both axes, without inverses."""
    down, across = np.indices(size)
    return [
        (255 * (((down + a * step) // side + (across + b * step) // side) % 2 == 0)).astype(
            np.uint8
        )
        for a in range(shifts)
        for b in range(shifts)
    ]


def sets_of(size: Size) -> dict[str, list[np.ndarray]]:
    """Return sets of patterns by name."""
    white, black = white_and_black(size)
    gray = [p for axis in (0, 1) for p in with_inverses(gray_code(size, axis))]
    rows = np.random.default_rng(0).permutation(size.pixels)[:60]
    own, _ = choose_plan(size, 100)
    return {
        "checkerboards of 2, inverses": [*checkerboards(size), white, black],
        "the same, levels 0.2 to 0.8": [
            np.rint(51 + 0.6 * p).astype(np.uint8) for p in (*checkerboards(size), white, black)
        ],
        "5x5 checkerboards of 3, black": [*shifted_checkerboards(size, 3, 1, 5), black],
        "sinusoids of 3, 4 steps": [*sinusoids(size), white, black],
        "fringes of 4, 3 steps, black": [
            *(fringes(size, 0, [4], 3) + fringes(size, 1, [4], 3)),
            black,
        ],
        "fringes of 4, columns alone": [*fringes(size, 1, [32, 4], 4), white, black],
        "Gray code, inverses": [*gray, white, black],
        "random, 40": [*random_binary(size, 40), black],
        "random, 20, inverses": [*with_inverses(random_binary(size, 20)), white, black],
        "Hadamard, 60 rows": [*(hadamard(size)[row] for row in rows), white, black],
        "a plan of 100 photos": [own.draw(i) for i in range(len(own.patterns))],
    }


def run(name: str, projector: Size | None) -> None:
    """Print one scene's table."""
    scene = cached_scene(name, projector) if projector else cached_scene(name)
    size = scene.projector
    white = np.ones(size, dtype=np.float32)
    scene = scene * (BRIGHTEST / (scene @ white).max())
    direct, near, far = scene.component_pictures(white)
    print(f"{name}: projector {size}, camera {scene.camera}")

    def say(what: str, found: Separation, used: str) -> None:
        one, other = snr(direct, found.direct), snr(near + far, found.global_)
        print(f"  {what:<34}{used:>10}{one:8.1f}{other:8.1f}", flush=True)

    for pictures in sets_of(size).items():
        with tempfile.TemporaryDirectory() as folder:
            shown = read_shown(write_pictures(Path(folder, "patterns"), pictures[1]))
            photos = write_pictures(Path(folder, "photos"), photograph(scene, pictures[1]))
            named = pair(shown.plan, photos)
            path = Path(folder, "capture.zarr")
            made = import_photos(shown.plan, named, path, full_scale=16383, shown=shown)
            found = separate_capture(made.capture)
        say(pictures[0], found.pictures, f"{found.numbers['patterns']}/{len(pictures[1])}")
    for method in (by_checkerboards(), by_sinusoids()):
        rig = SimulatedRig(scene, name, SimulatedProjector(), SimulatedCamera(), 1.0, 0)
        assert method.draw is not None
        taken = shoot_to_separate(rig, method.draw(size))
        pattern = f"{method.settings['pattern']}, by --rig"
        say(pattern, separate(taken, method.separate), f"{len(taken.photos) + 1}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["cornell", "corner"])
    parser.add_argument("--projector", type=parse_size)
    given = parser.parse_args()
    for scene_name in given.scenes:
        run(scene_name, given.projector)
