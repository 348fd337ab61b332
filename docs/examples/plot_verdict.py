"""
Photos that are not what they seem
==================================

A projector with a gamma that nobody calibrated: the verdict notices, and names it.
"""

import tempfile
from pathlib import Path

from matplotlib import pyplot

import nearfar
from nearfar.files import to_srgb

size = nearfar.Size(24, 24)
plan, _ = nearfar.choose_plan(size, 60)
folder = tempfile.TemporaryDirectory()

# %%
# Two rigs before the same bookshelf, described as users do in a RIG.toml.
pictures = {}
light = nearfar.natural_picture(size, seed=5)
for gamma in (1.0, 1.8):
    path = f"{folder.name}/gamma-{gamma}"
    table = f'[scene]\nname = "shelf"\n[projector]\ngamma = {gamma}\n'
    Path(f"{path}.toml").write_text(table)
    rig = nearfar.open_rig(f"{path}.toml", size)
    capture = nearfar.acquire(plan, f"{path}-capture.zarr", rig)
    nearfar.reconstruct_to_file(capture, f"{path}.zarr")
    verdict = nearfar.judge_transport(f"{path}.zarr", capture).kept
    print(f"gamma {gamma}: {verdict.grade}, held-out SNR {verdict.held_out_snr:.1f} dB")
    for reason in verdict.reasons:
        print(f"   {reason.cause}: {reason.sentence}")
    relit = nearfar.load_transport(f"{path}.zarr") @ light
    pictures[f"gamma {gamma}: {verdict.grade}"] = relit

# %%
# Neither picture looks wrong by itself. That is why a few photos are kept from the estimate.
pictures["the scene under that light"] = rig.world @ light
figure, axes = pyplot.subplots(1, 3, figsize=(10, 3.6), layout="constrained")
for axis, (name, picture) in zip(axes, pictures.items(), strict=True):
    axis.imshow(to_srgb(picture / picture.max()))
    axis.set(title=name, xticks=(), yticks=())
