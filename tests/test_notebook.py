"""What a notebook shows: run in a real kernel."""

import nbclient
import nbformat
import pytest

CELLS = [
    """
import nearfar
from nearfar.rigs.simulated.camera import SimulatedCamera
from nearfar.rigs.simulated.projector import SimulatedProjector
from nearfar.rigs.simulated.rig import SimulatedRig
from tests.worlds import model_transport
size = nearfar.Size(12, 16)
world = model_transport(size, size, window=3, far=nearfar.Size(3, 3), channels=3)
rig = SimulatedRig(world, "test", SimulatedProjector(), SimulatedCamera(), 1.0, 0)
plan, _ = nearfar.choose_plan(size, 40)
plan
""",
    """
with nearfar.progress_bar() as report:
    capture = nearfar.acquire(plan, PATH, rig, progress=report)
capture
""",
    """
with nearfar.progress_bar() as report:
    transport, _ = nearfar.reconstruct(capture, progress=report)
transport
""",
    """
%matplotlib inline
transport.plot.row(5, 6, errors=nearfar.ErrorBars(transport));
""",
    "transport.plot.components(nearfar.white(size));",
]


@pytest.mark.slow
def test_a_notebook_shows_plans_captures_transports_and_progress(tmp_path):
    cells = [cell.strip().replace("PATH", repr(str(tmp_path / "c.zarr"))) for cell in CELLS]
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
    nbclient.NotebookClient(notebook, timeout=600, kernel_name="python3").execute()

    def shown(number, kind):
        outputs = notebook.cells[number].outputs
        return [o.data[kind] for o in outputs if kind in o.get("data", {})]

    (plan,) = shown(0, "text/html")
    assert "<b>plan</b>" in plan
    assert "40: " in plan
    bar, capture = shown(1, "text/html")
    assert "photos <progress" in bar
    assert "100%" in bar
    assert "40 of 12x16, 3 channels" in capture
    bar, transport = shown(2, "text/html")
    assert "reconstructing <progress" in bar
    assert transport.count("<img") == 4
    assert "<td" in transport
    for number in (3, 4):
        (plot,) = shown(number, "image/png")
        assert len(plot) > 5000
    for cell in notebook.cells:
        assert not [o for o in cell.outputs if o.output_type in {"error", "stream"}]
