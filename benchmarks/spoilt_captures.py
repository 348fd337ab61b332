"""How many spoilt captures are noticed, and by which cause; and how many good ones are accused.

Run ``python benchmarks/spoilt_captures.py [SPOIL ... | good | pairs]``. Captures are of the Cornell
box, 64x64, 117 photos, each spoilt in one way at the weakest strength that costs at least 3 dB of
pictures. For each it prints the SNR_b of three natural pictures, what was said, and whether it is
right. Then come good captures of all scenes, at several sizes and numbers of photos. With ``pairs``
single photos are spoilt in captures of inverse pairs, 24x24, and good ones of all scenes follow.
Pillow is needed for JPEG.
"""

import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from nearfar import NearfarError, Size, natural_picture, paper_plan, reconstruct_to_file
from nearfar.capture.writing import write_capture
from nearfar.transport.stored import StoredTransport, open_transport
from nearfar.workflow.evaluate import decibels
from nearfar.workflow.verdict.verdict import Verdict, judge_reconstruction
from spoils import SPOILS, Photos, Shot, shoot, shoot_plan

PICTURES = 3
COST = 3.0
SCENES = ("cornell", "cornell-aside", "shelf", "alcove", "wedge", "corner")
GOOD = ((24, 60), (28, 70), (32, 90), (40, 117), (32, 160))
SEEDS = (0, 1)
# Ways that spoil single photos.
SINGLE = (
    "photos swapped",
    "photos rotated",
    "photos mirrored",
    "photos doubled",
    "photos torn",
    "photos interlaced",
    "exposure of three photos",
    "colours swapped",
    "photos of black",
)
PAIRS = paper_plan(Size(24, 24), 7, Size(5, 5), correspondence="phase")


def judged(shot: Shot, photos: Photos, folder: Path) -> tuple[StoredTransport, Verdict]:
    """Reconstruct photos, and return the transport with the verdict on it."""
    capture = write_capture(
        shot.plan, folder / "capture.zarr", list(photos), full_scale=shot.full_scale
    )
    reconstruct_to_file(capture, folder / "transport.zarr")
    stored = open_transport(folder / "transport.zarr")
    return stored, judge_reconstruction(stored, capture)


def accuses(verdict: Verdict) -> bool:
    """Return whether a verdict finds fault; that nothing was checked is none, as of pairs alone."""
    return verdict.grade != "good" and verdict.causes != ("unchecked",)


def picture_snr(shot: Shot, stored: StoredTransport) -> float:
    """Mean SNR_b of natural pictures, exposure free."""
    transport, found = stored.rows(), []
    for seed in range(PICTURES):
        light = natural_picture(shot.plan.projector, seed)
        known, relit = (shot.truth @ light).ravel(), (transport @ light).ravel()
        known = known * np.float32(known @ relit / (known @ known))
        found.append(decibels(float(known @ known), float(np.sum((known - relit) ** 2))))
    return float(np.mean(found))


def spoilt(names: Sequence[str], shot: Shot) -> None:
    """Print the table of the spoilt captures."""
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
                is_noticed = accuses(verdict)
                is_right = bool(verdict.causes) and verdict.causes[0] in way.causes
                noticed, right = noticed + is_noticed, right + is_right
                said = "right" if is_right else "noticed" if is_noticed else "missed"
                print(f"{name:32} {strength:5g} {found:5.1f} dB  {said:8} {verdict}", flush=True)
                break
    print(f"noticed {noticed}, right {right} of {len(names)}")


def good_shots() -> Iterator[tuple[str, Shot]]:
    """Yield good captures of plans that are chosen."""
    for scene in SCENES:
        for side, photos in GOOD:
            for seed in SEEDS:
                yield scene, shoot(scene, Size(side, side), photos, seed)


def good_pairs() -> Iterator[tuple[str, Shot]]:
    """Yield good captures of inverse pairs."""
    for scene in SCENES:
        for seed in SEEDS:
            yield scene, shoot_plan(scene, PAIRS, seed)


def good(shots: Iterable[tuple[str, Shot]]) -> None:
    """Print the verdicts on good captures that are accused, and how many there are."""
    accused = total = 0
    for scene, shot in shots:
        with tempfile.TemporaryDirectory() as folder:
            stored, verdict = judged(shot, shot.photos, Path(folder))
            snr = picture_snr(shot, stored)
        total += 1
        if accuses(verdict):
            accused += 1
            plan = shot.plan
            size = f"{plan.projector} {len(plan.patterns)}"
            print(f"{scene} {size}: {snr:.1f} dB, {verdict}", flush=True)
    print(f"{accused} of {total} good captures are not called good")


def main() -> None:
    """Print the tables."""
    names = sys.argv[1:]
    if names == ["pairs"]:
        spoilt(SINGLE, shoot_plan("cornell", PAIRS))
        good(good_pairs())
        return
    if names != ["good"]:
        spoilt(names or list(SPOILS), shoot("cornell", Size(64, 64), 117))
    if not names or names == ["good"]:
        good(good_shots())


if __name__ == "__main__":
    main()
