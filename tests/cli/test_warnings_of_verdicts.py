"""Commands warn of a transport that was judged wrong, and of no other."""

import pytest

from nearfar.transport.store_writing import write_verdict
from nearfar.transport.verdict import KeptVerdict, Reason
from tests.cli.conftest import Job, check_done, run_nearfar

WRONG = KeptVerdict("wrong", (Reason("order", "photos 3 and 4 are swapped: shoot again."),), 9.0)


@pytest.mark.parametrize("command", ["relight", "evaluate", "convert"])
def test_a_wrong_transport_is_warned_of_in_one_line(job: Job, command: str):
    output = job.folder / "out.npy"
    arguments = {
        "relight": ("relight", job.transport, job.light, output, "--force"),
        "evaluate": ("evaluate", job.transport, "--truth", job.apart),
        "convert": ("convert", job.transport, output, "--force"),
    }[command]
    write_verdict(job.transport, KeptVerdict("doubtful", WRONG.reasons, 20.0))
    before = check_done(run_nearfar(*arguments)).out
    write_verdict(job.transport, WRONG)
    ran = run_nearfar(*arguments)
    assert ran.status == 0
    assert ran.out == before
    assert ran.err == (
        f"warning: {job.transport} is wrong: Photos 3 and 4 are swapped: shoot again. Relit "
        f"pictures are off by 35 % (held-out SNR_b 9.0 dB).\n"
    )


def test_a_reconstruction_keeps_its_verdict(job: Job):
    said = check_done(run_nearfar("info", job.transport)).out
    assert said.startswith("good: Relit half-screens and wide bars are off by ")
