"""Processor time and peak memory of the commands, one after the other on one scene.

Run ``python benchmarks/commands.py [PROJECTOR [PHOTOS [CAMERA]]]``, such as ``64x64 117`` or
``256x256 200 320x320``. Each command is a process of its own, as a user starts it; its time is the
processor's, user and system, so that other work on the machine does not count. What the scene takes
to compute for the first time stands apart, in the row of ``render``.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

RIG = '[scene]\nname = "cornell-aside"\n'
COMMANDS = (
    "render cornell-aside truth.zarr --projector {projector} {camera}",
    "plan --projector {projector} --photos {photos} -o plan.json",
    "export plan.json patterns",
    "acquire plan.json capture.zarr --rig rig.toml",
    "info capture.zarr",
    "reconstruct capture.zarr transport.zarr",
    "reconstruct capture.zarr reported.zarr --report report.html",
    "relight transport.zarr light.npy relit.png",
    "relight transport.zarr light.npy glowing.png --gain subsurface=2",
    "relight transport.zarr light.npy sigma.npy --error-bars",
    "evaluate transport.zarr --truth truth.zarr",
    "compensate transport.zarr wanted.npy compensating.png",
    "bounces transport.zarr bounces --n 3",
    "probe transport.zarr near.png --within 3",
    "dual transport.zarr dual.png",
    "convert transport.zarr T.npy",
)
LIGHT = """
import sys, numpy, nearfar
transport = nearfar.load_transport("transport.zarr")
light = nearfar.natural_picture(transport.projector, 1)
numpy.save("light.npy", light)
numpy.save("wanted.npy", transport @ light)
"""


def run(arguments: list[str], folder: Path) -> tuple[int, float, float]:
    """Run a program; return its exit status, seconds of processor time and peak memory in MB."""
    with (folder / "said.txt").open("w") as said:
        process = subprocess.Popen(arguments, cwd=folder, stdout=said, stderr=said)
        _, status, used = os.wait4(process.pid, 0)
    return os.waitstatus_to_exitcode(status), used.ru_utime + used.ru_stime, used.ru_maxrss / 1e3


def main() -> None:
    """Print a row of a table for each command."""
    given = sys.argv[1:]
    projector, photos, camera = [*given, *("64x64", "117", "")[len(given) :]]
    sizes = {
        "projector": projector,
        "photos": photos,
        "camera": f"--camera {camera}" if camera else "",
    }
    nearfar = str(Path(sys.executable).parent / "nearfar")
    print(f"projector {projector}, {photos} photos, camera {camera or 'as the scene has it'}")
    print("| command | processor time | peak memory |\n| --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "rig.toml").write_text(RIG + (f'camera = "{camera}"\n' if camera else ""))
        for command in COMMANDS:
            text = command.format(**sizes)
            status, seconds, megabytes = run([nearfar, *text.split(), "--quiet"], folder)
            ended = "" if status == 0 else f" (exit status {status})"
            print(
                f"| `nearfar {text.strip()}`{ended} | {seconds:.1f} s | {megabytes:.0f} MB |",
                flush=True,
            )
            if command.startswith("reconstruct") and not (folder / "light.npy").exists():
                run([sys.executable, "-c", LIGHT], folder)


if __name__ == "__main__":
    main()
