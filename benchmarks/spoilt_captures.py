"""How many spoilt captures are noticed, and by which cause; and how many good ones are accused.

Run ``python benchmarks/spoilt_captures.py [SPOIL ... | good]``. Captures are of the Cornell box,
64x64, 117 photos, each spoilt in one way at the weakest strength that costs at least 3 dB of
pictures. For each it prints the SNR_b of three natural pictures, what was said, and whether it is
right. Then come good captures of all scenes, at several sizes and numbers of photos. Pillow is
needed for JPEG.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

from nearfar import NearfarError, Size, natural_picture, reconstruct_to_file
from nearfar.capture.writing import write_capture
from nearfar.transport.store import StoredTransport, open_transport
from nearfar.workflow.evaluate import decibels
from nearfar.workflow.verdict.verdict import Verdict, judge_reconstruction
from spoils import SPOILS, Photos, Shot, shoot

PICTURES = 3
COST = 3.0
SCENES = ("cornell", "cornell-aside", "shelf", "alcove", "wedge", "corner")
GOOD = ((24, 60), (28, 70), (32, 90), (40, 117), (32, 160))
SEEDS = (0, 1)


def judged(shot: Shot, photos: Photos, folder: Path) -> tuple[StoredTransport, Verdict]:
    """Reconstruct photos, and return the transport with the verdict on it."""
    capture = write_capture(
        shot.plan, folder / "capture.zarr", list(photos), full_scale=shot.full_scale
    )
    reconstruct_to_file(capture, folder / "transport.zarr")
    stored = open_transport(folder / "transport.zarr")
    return stored, judge_reconstruction(stored, capture)


def picture_snr(shot: Shot, stored: StoredTransport) -> float:
    """Mean SNR_b of natural pictures, exposure free."""
    transport, found = stored.rows(), []
    for seed in range(PICTURES):
        light = natural_picture(shot.plan.projector, seed)
        known, relit = (shot.truth @ light).ravel(), (transport @ light).ravel()
        known = known * np.float32(known @ relit / (known @ known))
        found.append(decibels(float(known @ known), float(np.sum((known - relit) ** 2))))
    return float(np.mean(found))


def spoilt(names: list[str]) -> None:
    """Print the table of the spoilt captures."""
    shot = shoot("cornell", Size(64, 64), 117)
    noticed = right = 0
    with tempfile.TemporaryDirectory() as folder:
        stored, verdict = judged(shot, shot.photos, Path(folder))
        best = picture_snr(shot, stored)
    print(f"{'good':32} {best:5.1f} dB  {verdict}", flush=True)
    for name in names:
        way = SPOILS[name]
        for strength in way.strengths:
            try:
                with tempfile.TemporaryDirectory() as folder:
                    stored, verdict = judged(shot, way.apply(shot, strength), Path(folder))
                    found = picture_snr(shot, stored)
            except NearfarError as error:
                print(f"{name:32} {strength:5g}   refused: {error}", flush=True)
                noticed, right = noticed + 1, right + 1
                break
            if best - found >= COST or strength == way.strengths[-1]:
                is_noticed = verdict.grade != "good"
                is_right = bool(verdict.causes) and verdict.causes[0] in way.causes
                noticed, right = noticed + is_noticed, right + is_right
                said = "right" if is_right else "noticed" if is_noticed else "missed"
                print(f"{name:32} {strength:5g} {found:5.1f} dB  {said:8} {verdict}", flush=True)
                break
    print(f"noticed {noticed}, right {right} of {len(names)}")


def good() -> None:
    """Print the verdicts on good captures that are not good, and how many there are."""
    accused = total = 0
    for scene in SCENES:
        for side, photos in GOOD:
            for seed in SEEDS:
                shot = shoot(scene, Size(side, side), photos, seed)
                with tempfile.TemporaryDirectory() as folder:
                    stored, verdict = judged(shot, shot.photos, Path(folder))
                    snr = picture_snr(shot, stored)
                total += 1
                if verdict.grade != "good":
                    accused += 1
                    print(f"{scene} {side}x{side} {photos}: {snr:.1f} dB, {verdict}", flush=True)
    print(f"{accused} of {total} good captures are not called good")


def main() -> None:
    """Print the tables."""
    names = sys.argv[1:]
    if names != ["good"]:
        spoilt(names or list(SPOILS))
    if not names or names == ["good"]:
        good()


if __name__ == "__main__":
    main()
