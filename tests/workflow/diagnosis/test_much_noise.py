"""What noise and the shrinking of estimates leave of photos is not taken for a fault of the rig."""

from nearfar.arrays import Size
from nearfar.plan import choose_plan
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from nearfar.scenes.hostile import hostile_transport
from nearfar.transport.store import open_transport
from nearfar.workflow.acquire import acquire
from nearfar.workflow.reconstruction.reconstruct import reconstruct_to_file
from nearfar.workflow.verdict.verdict import judge_reconstruction


def test_shrunk_estimates_are_not_taken_for_a_bent_response(tmp_path):
    scene = hostile_transport("glass", Size(16, 16), Size(20, 20))
    camera = SimulatedCamera(
        full_well=1e6, read_noise=1e6 / 60, bits=16, black_level=0.12, shot_noise=False
    )
    plan, _ = choose_plan(scene.projector, 179)
    rig = SimulatedRig(scene, "glass", SimulatedProjector(), camera, 0.8, 0)
    capture = acquire(plan, tmp_path / "capture.zarr", rig)
    reconstruct_to_file(capture, tmp_path / "transport.zarr")
    verdict = judge_reconstruction(open_transport(tmp_path / "transport.zarr"), capture)
    assert "not-linear" not in verdict.causes
