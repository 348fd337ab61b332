"""Whether the photos needed grow with the camera: the Cornell box from aside at several cameras.

Run ``python benchmarks/camera_sizes.py``. The projector has 64 x 64 pixels; plans of 58, 117 and
234 photos are shot by cameras of 64 x 64 to 192 x 192, q is found by phase, and SNR_b under
pictures, white and a random light is printed.
"""

from accuracy import scores, shoot
from nearfar import Size, choose_plan
from nearfar.correspondence import correspond_by_phase
from nearfar.estimate.joint import estimate_jointly
from nearfar.illumination.pictures import standard_lights
from nearfar.photometry.measure import measure
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.scenes.cache import cached_scene

SIDES = (64, 96, 128, 192)
PHOTOS = (58, 117, 234)


def main() -> None:
    """Print a row for each camera and plan."""
    print("camera, photos: pictures, white, random (dB)")
    for side in SIDES:
        scene = cached_scene("cornell-aside", None, Size(side, side))
        lights = standard_lights(scene.projector)
        truth = {name: scene @ light for name, light in lights.items()}
        for photos in PHOTOS:
            plan, _ = choose_plan(scene.projector, photos, checks=0)
            measurements = measure(shoot(plan, scene, SimulatedCamera()))
            q = correspond_by_phase(measurements, pitch=plan.pitch).q
            found = estimate_jointly(measurements, q, plan.window, plan.far, pitch=plan.pitch)
            print(f"{scene.camera}, {photos}: {scores(truth, found, lights)}", flush=True)


if __name__ == "__main__":
    main()
