"""``nearfar evaluate``."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from nearfar.cli.command_line import command_line
from nearfar.cli.opening import load_reconstructed
from nearfar.cli.options import (
    AsJson,
    Force,
    Quiet,
    ReportPath,
    TransportPath,
    check_report_page,
)
from nearfar.cli.saying import say, warn
from nearfar.decibels import EXACT, ROUNDING
from nearfar.progress import progress_bar

# What is compared, where the key alone does not tell which split it is of.
EXPLAINED = {
    "snr": "T, and the model's split D, N, F",
    "physical": "rows beside the scene's components",
    "floodlit": "pictures under white beside the scene's components",
    "model": "rows beside the model's split of the scene",
    "physical_split": "pictures under white beside the scene's components",
}


def evaluate(
    transport: TransportPath,
    truth: Annotated[
        Path | None,
        typer.Option(
            help="What render wrote, or a dense T of any origin (.npy, .npz), which is scaled to "
            "the photos where their exposure is not known.",
            metavar="TRUTH",
        ),
    ] = None,
    photos: Annotated[
        Path | None,
        typer.Option(
            help="Folder of pairs NAME.light.png, NAME.photo.tiff; the photo under an all-black "
            "light, if there is one, is subtracted.",
            metavar="DIR",
        ),
    ] = None,
    full_scale: Annotated[
        float | None, typer.Option(help="Value of the photos at full scale.", metavar="VALUE")
    ] = None,
    report: ReportPath = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Measure a transport: SNR_b of relighting, SNR_t of rows, its components.

    Example: nearfar evaluate transport.zarr --truth truth.zarr --json
    """
    from nearfar.transport.exact_store import load_exact
    from nearfar.workflow.evaluate import row_snr
    from nearfar.workflow.judge import (
        REMARKS,
        beside_photos,
        beside_truth,
        describe_units,
        find_faults_of_units,
        judge_by_truth,
        judge_pairs,
    )

    if (truth is None) == (photos is None):
        raise typer.BadParameter("give either --truth or --photos.", param_hint="--truth")
    if report is not None:
        check_report_page(
            report, transport, *(path for path in (truth, photos) if path), force=force
        )
    with progress_bar("evaluating", quiet=quiet) as told:
        opened = load_reconstructed(transport)
        if truth is not None:
            known = load_exact(truth, projector=opened.projector, camera=opened.camera)
            rows = row_snr(opened, known, progress=told)
            found = judge_by_truth(opened, known, rows, progress=told)
            faults = find_faults_of_units(opened, known, str(truth))
        else:
            assert photos is not None
            rows, pairs = None, beside_photos(opened, photos, full_scale=full_scale)
            found, faults = judge_pairs(pairs), []
        if report is not None:
            from nearfar.report.evaluation import evaluation_page
            from nearfar.report.page import write_page

            if truth is not None:
                pairs = beside_truth(opened, known)
            text = evaluation_page(
                opened, str(truth or photos), found, pairs, rows, faults, command=command_line()
            )
            write_page(report, text, force=force)
    for fault in faults:
        warn(fault)
    if as_json:
        print(json.dumps(found, allow_nan=False))
    else:
        shown = {name: value for name, value in found.items() if name not in REMARKS}
        say("\n".join([_lines(shown), *describe_units(found)]), quiet=quiet)


def _is_spread(value: object) -> bool:
    """Return whether it is a mean and percentiles."""
    return isinstance(value, dict) and "p50" in value


def _table(spreads: dict[str, dict[str, float]], indent: str) -> list[str]:
    """Return means and percentiles as the lines of a table, in dB."""
    columns = next(iter(spreads.values()))
    rows = [["dB", *columns]]
    rows += [
        [name, *(_cell(value[column]) for column in columns)] for name, value in spreads.items()
    ]
    width = max(len(cell) for row in rows for cell in row[1:]) + 2
    return [
        f"{indent}{row[0]:<16}{''.join(f'{cell:>{width}}' for cell in row[1:])}" for row in rows
    ]


def _cell(decibels: float) -> str:
    return f"{decibels:.2f}" if decibels <= ROUNDING else "exact"


def _shown(decibels: float) -> str:
    return f"{decibels:8.2f} dB" if decibels <= ROUNDING else f"  {EXACT}"


def _lines(found: dict[str, Any], indent: str = "") -> str:
    lines = []
    spreads = {name: value for name, value in found.items() if _is_spread(value)}
    for name, value in found.items():
        if name in spreads:
            lines += _table(spreads, indent) if name == next(iter(spreads)) else []
        elif isinstance(value, dict):
            heading = f"{name}: {EXPLAINED[name]}" if name in EXPLAINED else name
            lines += [f"{indent}{heading}", _lines(value, indent + "  ")]
        else:
            shown = _shown(value) if isinstance(value, float) else str(value)
            lines.append(f"{indent}{name:<16}{shown}")
    return "\n".join(lines)
