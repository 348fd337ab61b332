"""Reconstructions that are gone on with: a block that is written is not worked at again."""

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from nearfar.arrays import AnyPath
from nearfar.capture import Capture
from nearfar.correspondence import Correspondence
from nearfar.devices import Device
from nearfar.errors import InputError, KeptInterrupt, NearfarError
from nearfar.files import UNFINISHED, resumable_output
from nearfar.files.logs import note, read_notes
from nearfar.release import version
from nearfar.transport.store import write_provenance
from nearfar.workflow.blocks import (
    MEMORY,
    Job,
    Progress,
    prepare,
    reconstruct_block,
    unheard,
    without_light,
)
from nearfar.workflow.methods import Method
from nearfar.workflow.written import Written, write_block

# A line for the work as a whole and one for each block that is written; gone in the end.
LOG = "blocks.jsonl"


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
) -> Written:
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
    Written
        Of the whole camera.

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
) -> Written:
    def worth(folder: Path, _why: BaseException) -> bool:
        return bool(_blocks(folder))

    with resumable_output(output, worth, resume=resume, force=force) as folder:
        job = prepared()
        about = _about(job, correspondence)
        if before := _lines(folder):
            _require_same(folder, before[0], about)
        else:
            note(folder / LOG, about)
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
) -> Written:
    """Reconstruct and write the blocks that are missing."""
    written = _blocks(folder)
    # What was being written when it was killed.
    for left in folder.rglob(".*.partial"):
        left.unlink()
    whole = Written()
    for block in job.cut.blocks():
        done = written.get(block.start)
        if done is None:
            known = job.cut.known_around(block, correspondence)
            part = reconstruct_block(job, block, known, job.cut.report_of(block, report))
            done = write_block(folder, job.cut, block, part)
            note(folder / LOG, {"start": block.start, **done._asdict()})
        whole = whole.with_block(done)
        report("reconstructing", block.stop / job.cut.height)
    if not whole.lit:
        raise without_light(job.capture)
    return whole


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
    return hashlib.sha256(np.ascontiguousarray(correspondence.q).tobytes()).hexdigest()


def _require_same(folder: Path, before: Mapping[str, Any], about: Mapping[str, Any]) -> None:
    other = [name for name in about if before.get(name) != about[name]]
    if other:
        raise InputError(
            f"{folder} was begun with another {', '.join(other)}: give the same, or begin anew "
            f"with --force."
        )


def _blocks(folder: Path) -> dict[int, Written]:
    """Return what is said of the blocks that are written, by their first row."""
    fields = Written._fields
    return {
        words["start"]: Written(*(words[name] for name in fields))
        for words in _lines(folder)
        if words.keys() >= {"start", *fields}
    }


def _lines(folder: Path) -> list[Mapping[str, Any]]:
    """Read the log: what blocks have in common, and then the blocks."""
    return read_notes(folder / LOG, lambda words: words)
