"""Direct-global separation against the truth on the exact scenes.

Run ``python benchmarks/separation.py [SCENE ...]``. For each pattern it prints the SNR in dB of
the direct and of the global picture under full white, direct/global, photos of the method alone:

- clean: a camera without noise, the photo under black subtracted;
- noisy: 30 000 e- at full well, 4 e- of read noise, 14 bits, one photo under black;
- ambient: clean, with a projector whose black is 5 % of its white; ambient light is subtracted
  and the black level is told;
- extremes: clean and noisy by the brightest and the darkest photo alone (Nayar et al. 2006).

The default of ``nearfar separate`` is marked; on the corner it is asked for 30 dB when clean.
"""

import sys
from dataclasses import replace

import numpy as np

from nearfar import ExactTransport, snr
from nearfar.baselines.separation import separate_by_extremes
from nearfar.baselines.separation_methods import Method, by_checkerboards, by_sinusoids
from nearfar.baselines.separation_photos import PhotosToSeparate, separate, shoot_to_separate
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes import SCENES
from nearfar.scenes.cache import cached_scene

NOISY = SimulatedCamera()
CLEAN = SimulatedCamera(shot_noise=False, read_noise=0.0, full_well=1e9, bits=16)
BLACK_LEVEL = 0.05
DEFAULT = by_checkerboards()
METHODS = [
    *(by_checkerboards(side) for side in (1, 2, 3, 4, 8)),
    *(by_checkerboards(side, 1) for side in (3, 4, 8)),
    *(by_sinusoids(period) for period in (2, 3, 4, 6, 8, 16)),
]


def shoot(
    scene: ExactTransport, method: Method, camera: SimulatedCamera, black_level: float = 0.0
) -> PhotosToSeparate:
    """Photograph the patterns of a method, and black."""
    optics = SimulatedProjector(black_level=black_level)
    rig = SimulatedRig(scene, scene.name, optics, camera, 1.0, 0)
    assert method.draw is not None
    return shoot_to_separate(rig, method.draw(scene.projector))


def less_ambient(taken: PhotosToSeparate) -> PhotosToSeparate:
    """Put a photo of the ambient light of the clean camera in place of that under black."""
    nothing = np.zeros(taken.photos[0].shape, dtype=np.float32)
    ambient = CLEAN.photograph(nothing, np.random.default_rng(0))
    return replace(taken, dark=ambient, dark_shows="ambient", black_level=BLACK_LEVEL)


def run(name: str) -> None:
    """Print one scene's table."""
    scene = cached_scene(name)
    direct, near, far = scene.component_pictures(np.ones(scene.projector, dtype=np.float32))
    shares = [float(part.sum() / (direct + near + far).sum()) for part in (direct, near, far)]
    print(
        f"{name}: projector {scene.projector}, camera {scene.camera}, direct {shares[0]:.0%}, "
        f"near {shares[1]:.0%}, far {shares[2]:.0%}"
    )
    titles = ("clean", "noisy", "ambient", "extremes", "and noisy")
    print(f"  {'pattern':<26}" + "".join(f"{title:>13}" for title in titles))
    for method in METHODS:
        clean, noisy = shoot(scene, method, CLEAN), shoot(scene, method, NOISY)
        black = less_ambient(shoot(scene, method, CLEAN, BLACK_LEVEL))
        cells = []
        for taken, how in (
            (clean, method.separate),
            (noisy, method.separate),
            (black, method.separate),
            (clean, separate_by_extremes),
            (noisy, separate_by_extremes),
        ):
            found = separate(taken, how)
            one, other = snr(direct, found.direct), snr(near + far, found.global_)
            cells.append(f"{one:6.2f}/{other:6.2f}")
        label = " ".join(str(value) for value in method.settings.values())
        mark = "*" if method.settings == DEFAULT.settings else ""
        print(f"  {f'{label} ({method.count}){mark}':<26}{''.join(cells)}", flush=True)


if __name__ == "__main__":
    for scene_name in sys.argv[1:] or SCENES:
        run(scene_name)
