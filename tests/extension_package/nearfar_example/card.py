"""A grey card that faces the projector, in a room that sends back a tenth of all light."""

import numpy as np
from scipy import sparse

from nearfar.arrays import Size
from nearfar.scenes.description import SceneDescription
from nearfar.transport.exact import ExactTransport

DIRECT, FAR = 0.5, 0.1


def _compute(projector, camera, progress):
    y, x = np.indices(camera)
    seen = (y * projector.height // camera.height) * projector.width
    seen = (seen + x * projector.width // camera.width).ravel()
    shape = (camera.pixels, projector.pixels)
    light = np.full(camera.pixels, DIRECT, np.float32)
    direct = sparse.csr_array((light, (np.arange(camera.pixels), seen)), shape=shape)
    progress("card", 1.0)
    return ExactTransport(
        projector,
        camera,
        direct=(direct,),
        near=(sparse.csr_array(shape, dtype=np.float32),),
        far=np.full((1, *shape), FAR / projector.pixels, np.float32),
        name="card",
    )


CARD = SceneDescription(summary="a grey card", projector=Size(16, 16), compute=_compute)
