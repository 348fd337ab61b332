"""A verdict by photos that were left out of an estimate, and these photos one by one."""

from typing import NamedTuple

from nearfar.transport.verdict import KeptVerdict


class CheckedLight(NamedTuple):
    """A photo that an estimate did not see, and how well it was foretold.

    Attributes
    ----------
    photo : int
        Its number in the capture.
    snr : float
        Held-out SNR_b, dB.
    expected_snr : float or None
        The SNR_b that the error bars expect, dB; None without error bars.
    """

    photo: int
    snr: float
    expected_snr: float | None


class Judged(NamedTuple):
    """A verdict, and the photos by which.

    Attributes
    ----------
    verdict : KeptVerdict
    lights : tuple of CheckedLight
        None if nothing was checked.
    """

    verdict: KeptVerdict
    lights: tuple[CheckedLight, ...] = ()


class Reconstructed(NamedTuple):
    """What is to be said of a transport that was reconstructed into a file.

    Attributes
    ----------
    judged : Judged
    described : str
        What it is of, such as "40x30 camera pixels and 16 lamps".
    warnings : tuple of str
        A sentence each.
    """

    judged: Judged
    described: str
    warnings: tuple[str, ...] = ()
