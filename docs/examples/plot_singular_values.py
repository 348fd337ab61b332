"""
A transport in SciPy
====================

A transport is a linear operator: what works with ``scipy.sparse.linalg`` works with it, without a
matrix.
"""

import tempfile

from matplotlib import pyplot
from scipy.sparse.linalg import svds

import nearfar

size = nearfar.Size(32, 32)
plan, _ = nearfar.choose_plan(size, 80)
folder = tempfile.TemporaryDirectory()
rig = nearfar.open_rig("cornell", size)
capture = nearfar.acquire(plan, f"{folder.name}/capture.zarr", rig)
transport, _ = nearfar.reconstruct(capture)

# %%
# The largest singular values of the whole, and of far-range light alone. Those of the whole decay
# slowly, so that T has no low-rank form; far-range light has one (figure 1 of the paper).
whole = transport.as_linear_operator(channel=0)
far = transport.with_gains(direct=0.0, near=0.0).as_linear_operator(channel=0)
figure, axis = pyplot.subplots(layout="constrained")
for operator, name in ((whole, "T"), (far, "F")):
    values = svds(operator, k=30, return_singular_vectors=False)[::-1]
    axis.semilogy(range(1, 31), values, "o-", label=name)
axis.set(xlabel="number", ylabel="singular value")
axis.legend()
