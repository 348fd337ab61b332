"""Where the cameras and projectors of scenes stand, by their rays."""

import numpy as np
import pytest

import nearfar
from nearfar.arrays import Size
from nearfar.scenes import SCENES
from nearfar.scenes.optics import pinhole, place_of, sub_rays
from nearfar.scenes.rays import hit, surface
from nearfar.scenes.stereo import stereo_of_scene


@pytest.mark.parametrize(
    ("name", "projector", "camera"),
    [("cornell-aside", Size(16, 24), Size(32, 20)), ("shelf", Size(20, 30), Size(20, 30))],
)
def test_q_of_the_scenes_rays_gives_the_points_that_they_hit(name, projector, camera):
    scene = SCENES[name].compute.surfaces()
    eye, lens = (pinhole(view, projector) for view in (scene.projector_view, scene.camera_view))
    where = surface(scene.parts, range(len(scene.parts)))
    hits = hit(where, lens.position, sub_rays(lens, camera, 1)[0])
    # Pixel i reaches from i to i + 1 there.
    y, x, _ = place_of(eye, projector, hits.position)
    q = np.stack([y, x], axis=-1).reshape(*camera, 2) - 0.5
    found = nearfar.triangulate(
        nearfar.Correspondence(q, np.ones(camera)),
        stereo_of_scene(name, projector, camera),
        projector,
    )
    expected = (hits.position - lens.position) @ lens.axes.T * [1, -1, 1]
    np.testing.assert_allclose(found.points.reshape(-1, 3), expected, atol=1e-3)


def test_a_camera_in_the_projectors_place_is_refused():
    with pytest.raises(nearfar.NearfarError, match="shares the projector's pinhole"):
        stereo_of_scene("cornell")
