"""Reconstructions that are gone on with: a block that is written is not worked at again."""

import hashlib
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nearfar.arrays import AnyPath
from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.devices import Device
from nearfar.errors import InputError, KeptInterrupt, NearfarError
from nearfar.files import UNFINISHED, resumable_output
from nearfar.transport.store import write_provenance, write_rows
from nearfar.version import version
from nearfar.workflow.blocks import (
    MEMORY,
    Job,
    Progress,
    of_all,
    prepare,
    reconstruct_block,
    unheard,
    without_light,
)
from nearfar.workflow.methods import Method

# A line for the work as a whole and one for each block that is written; gone in the end.
LOG = "blocks.jsonl"


class Reconstructed(NamedTuple):
    """What is said of a transport that was written.

    Attributes
    ----------
    lit, pixels : int
        Camera pixels that are lit directly, and all.
    provenance : mapping
    """

    lit: int
    pixels: int
    provenance: Mapping[str, Any]


def reconstruct_into(
    output: AnyPath,
    capture: Capture,
    correspondence: Correspondence | None = None,
    *,
    method: Method = "joint",
    memory: int = MEMORY,
    device: Device = "cpu",
    half: bool = False,
    resume: bool = False,
    force: bool = False,
    progress: Progress | None = None,
) -> Reconstructed:
    """Reconstruct the transport of a capture into a file, block by block of camera rows.

    Until the last block they lie in a folder of the output's name with ``.unfinished`` behind it;
    whatever stops the work, kill -9 too, those that were written are gone on with.

    Parameters
    ----------
    output : str or Path
        Transport to write.
    capture, correspondence, method, memory, device, half, progress
        As `nearfar.workflow.reconstruct.reconstruct_in_blocks`.
    resume : bool
        Go on with the blocks that are there, of the same capture and options.
    force : bool
        Replace a transport that is there and, without `resume`, what was not finished.

    Returns
    -------
    Reconstructed

    Raises
    ------
    PlanError, InputError
        As `nearfar.reconstruct`; if what is there is of another capture or other options.
    NearfarError
        As `nearfar.files.resumable_output`. What was written is kept, and the message says where.
    KeptInterrupt
        If it was told to stop; likewise.
    """
    output, report = Path(output), progress or unheard
    if correspondence is not None and not correspondence.lit.any():
        raise without_light(capture)
    try:
        done = _into(
            output,
            lambda: prepare(
                capture,
                method=method,
                memory=memory,
                given=correspondence is not None,
                device=device,
                half=half,
                report=report,
            ),
            correspondence,
            report,
            resume=resume,
            force=force,
        )
    except KeyboardInterrupt as error:
        if kept := _kept(output):
            raise KeptInterrupt(f"interrupted; {kept}.") from error
        raise
    except NearfarError as error:
        if kept := _kept(output):
            raise type(error)(f"{str(error).removesuffix('.')}; {kept}.") from error
        raise
    (output.resolve() / LOG).unlink(missing_ok=True)
    return done


def _into(
    output: Path,
    prepared: Callable[[], Job],
    correspondence: Correspondence | None,
    report: Progress,
    *,
    resume: bool,
    force: bool,
) -> Reconstructed:
    def worth(folder: Path, _why: BaseException) -> bool:
        return bool(_blocks(folder))

    with resumable_output(output, worth, resume=resume, force=force) as folder:
        job = prepared()
        about = _about(job, correspondence)
        if _lines(folder):
            _require_same(folder, about)
        else:
            _note(folder, about)
        done = _work(job, correspondence, folder, report)
        write_provenance(folder, done.provenance)
    return done


def _kept(output: Path) -> str:
    """Say what is kept of what was stopped; nothing if nothing is."""
    folder = output.resolve().with_name(f"{output.resolve().name}{UNFINISHED}")
    count = len(_blocks(folder))
    again = "--resume --force" if output.exists() else "--resume"
    return (
        f"{count} blocks of rows are kept in {folder}, and {again} goes on with them"
        if count
        else ""
    )


def _work(
    job: Job, correspondence: Correspondence | None, folder: Path, report: Progress
) -> Reconstructed:
    """Reconstruct and write the blocks that are missing."""
    written = {block["start"]: block for block in _blocks(folder)}
    # What was being written when it was killed.
    for left in folder.rglob(".*.partial"):
        left.unlink()
    height, lit, pixels = job.cut.height, 0, 0
    provenance: Mapping[str, Any] = {}
    for block in job.cut.blocks():
        noted = written.get(block.start)
        if noted is None:
            noted = _block(job, block, correspondence, folder, report)
        lit, pixels = lit + noted["lit"], pixels + noted["pixels"]
        provenance = of_all(provenance, noted["provenance"])
        report("reconstructing", block.stop / height)
    if not lit:
        raise without_light(job.capture)
    return Reconstructed(lit, pixels, provenance)


def _block(
    job: Job, block: slice, correspondence: Correspondence | None, folder: Path, report: Progress
) -> dict[str, Any]:
    """Reconstruct a block, write it, and note it."""
    height = job.cut.height
    known = correspondence.of_rows(job.cut.around(block)) if correspondence else None

    def done(share: float) -> None:
        report("reconstructing", (block.start + share * (block.stop - block.start)) / height)

    part = reconstruct_block(job, block, known, done)
    write_rows(folder, part.transport, block.start, rows=job.cut.rows, height=height)
    lit = part.correspondence.lit
    noted = {
        "start": block.start,
        "lit": int(lit.sum()),
        "pixels": int(lit.size),
        "provenance": dict(part.transport.provenance),
    }
    _note(folder, noted)
    return noted


def _about(job: Job, correspondence: Correspondence | None) -> dict[str, Any]:
    """Tell what blocks must have in common."""
    described = (job.capture.path / "zarr.json").read_bytes()
    return {
        # Photos that were taken again have other times.
        "capture": hashlib.sha256(described + job.capture.times.tobytes()).hexdigest(),
        "correspondence": _digest(correspondence),
        "method": job.method,
        "device": job.device,
        "half": job.half,
        "memory": job.cut.rows,
        "nearfar": version(),
    }


def _digest(correspondence: Correspondence | None) -> str:
    if correspondence is None:
        return ""
    return hashlib.sha256(np.ascontiguousarray(correspondence.pixels).tobytes()).hexdigest()


def _require_same(folder: Path, about: Mapping[str, Any]) -> None:
    before = _lines(folder)[0]
    other = [name for name in about if before.get(name) != about[name]]
    if other:
        raise InputError(
            f"{folder} was begun with another {', '.join(other)}: give the same, or begin anew "
            f"with --force."
        )


def _note(folder: Path, line: Mapping[str, Any]) -> None:
    """Add a line to the log, and wait for the disk."""
    log = os.open(folder / LOG, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
    try:
        os.write(log, (json.dumps(line) + "\n").encode())
        os.fsync(log)
    finally:
        os.close(log)


def _blocks(folder: Path) -> list[dict[str, Any]]:
    return _lines(folder)[1:]


def _lines(folder: Path) -> list[dict[str, Any]]:
    """Read the log; what a crash tore off its last line is cut away."""
    path = folder / LOG
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        return []
    lines: list[dict[str, Any]] = []
    whole = 0
    for line in data.splitlines(keepends=True):
        try:
            noted = json.loads(line)
        except ValueError:
            break
        if not line.endswith(b"\n") or not isinstance(noted, dict):
            break
        lines.append(noted)
        whole += len(line)
    if whole < len(data):
        os.truncate(path, whole)
    return lines
