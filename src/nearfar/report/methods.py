"""Paragraphs of methods, ready to cite: what was done, with the numbers of this very run."""

from collections.abc import Mapping
from typing import Any

from nearfar.arrays import Size
from nearfar.decibels import in_words
from nearfar.plan import Plan
from nearfar.release import version
from nearfar.report.about import PAPER, Methods, software_reference
from nearfar.report.plan import count_by_sort, describe_window
from nearfar.transport.model import Transport
from nearfar.transport.stored import StoredTransport
from nearfar.transport.verdict import KeptVerdict
from nearfar.workflow.check import ModelCheck
from nearfar.workflow.comparison import Comparison
from nearfar.workflow.rivals import RIVALS
from nearfar.workflow.verdict.held_out import PICTURES, HeldOut

PEERS = (
    "Peers, P., Mahajan, D.K., Lamond, B., Ghosh, A., Matusik, W., Ramamoorthi, R., Debevec, P.: "
    "Compressive Light Transport Sensing. ACM Transactions on Graphics 28(1), 2009."
)
SCHECHNER = (
    "Schechner, Y.Y., Nayar, S.K., Belhumeur, P.N.: A Theory of Multiplexed Illumination. IEEE "
    "International Conference on Computer Vision (ICCV), 2003."
)
OTOOLE = (
    "O'Toole, M., Kutulakos, K.N.: Optical Computing for Fast Light Transport Analysis. ACM "
    "Transactions on Graphics 29(6) (SIGGRAPH Asia), 2010."
)
JIANG = (
    "Jiang, H., Li, Y., Zhao, H., Li, X., Xu, Y.: Parallel Single-Pixel Imaging: A General Method "
    "for Direct-Global Separation and 3D Shape Reconstruction Under Strong Global Illumination. "
    "International Journal of Computer Vision 129, 2021."
)
SEN = (
    "Sen, P., Chen, B., Garg, G., Marschner, S.R., Horowitz, M., Levoy, M., Lensch, H.P.A.: Dual "
    "Photography. ACM Transactions on Graphics 24(3) (SIGGRAPH), 2005."
)
GARG = (
    "Garg, G., Talvala, E.-V., Levoy, M., Lensch, H.P.A.: Symmetric Photography: Exploiting "
    "Data-sparseness in Reflectance Fields. Eurographics Symposium on Rendering, 2006."
)
HARWIT = "Harwit, M., Sloane, N.J.A.: Hadamard Transform Optics. Academic Press, 1979."
# What the methods of `nearfar compare` go back to, beside the paper.
REFERENCES_OF_RIVALS = {
    "CLT": PEERS,
    "Arnoldi": OTOOLE,
    "Arnoldi after D": OTOOLE,
    "parallel single-pixel": JIANG,
    "adaptive dual": SEN,
    "symmetric": GARG,
    "Hadamard": SCHECHNER,
}

PURPOSES = {
    "direct": "of the checkerboard, for direct light",
    "near": "of sinusoids for near-range light",
    "far": "of sinusoids for far-range light",
    "reference": "of white and black",
    "correspondence": "for correspondence",
    "check": "to check by",
}
OFFSETS = {
    "inverse": "Every sinusoid was followed by its inverse, which takes the offset out.",
    "reference": (
        "The sinusoids' offset, and the drift of lamp and ambient light, were taken out by the "
        "whites and blacks, which were photographed at intervals."
    ),
    "none": "The patterns were complex, in theory, and have no offset.",
}
OF_CODES = (
    "Each code lit about half of the projector's pixels, as a row of an S-matrix does [3]; the "
    "response to every sinusoid was taken from the photos of all codes together, by least squares, "
    "and from photos of the sinusoid itself, if there are any. "
    "The drift of lamp and ambient light was taken out by the whites and blacks, which were "
    "photographed at intervals."
)
CORRESPONDENCES = {
    "phase": "by the phase of the sinusoids' own photos",
    "stripes": "by photos of stripes",
    "gray": "by photos of Gray code",
}
ESTIMATES = {
    "joint": (
        "Each camera pixel's row was estimated from its responses to sinusoids and to white, as "
        "the mean of a Gaussian posterior whose prior the photos choose [2]; its covariance gives "
        "the error bars."
    ),
    "paper": "Each camera pixel's row was estimated by the estimator of [1].",
}
ESTIMATE_FROM_PATTERNS = (
    "Each camera pixel's row was estimated from its photos as the mean of a Gaussian posterior "
    "whose prior the photos choose [2]; its covariance gives the error bars."
)


def reconstruction_methods(
    transport: StoredTransport | Transport,
    plan: Plan,
    checked: str,
    *,
    correspondence_given: bool = False,
) -> Methods:
    """Return how a transport was measured, estimated and checked.

    Parameters
    ----------
    transport : StoredTransport or Transport
    plan : Plan
        Of the photos that it was reconstructed from.
    checked : str
        How it was checked, a sentence.
    correspondence_given : bool
        Whether q was given, and not found in the photos.
    """
    sentences = [
        f"The light transport from a projector of {plan.projector} pixels to a camera of "
        f"{transport.camera} pixels ({counted(transport.channels, 'channel')}) was measured by "
        f"frequency-space decomposition [1], from {len(plan.patterns)} photos: "
        f"{_purposes(plan)}.",
        OF_CODES if plan.is_by_codes else OFFSETS[plan.offset],
        _correspondence(plan, given=correspondence_given),
        _estimate(transport.provenance, describe_window(plan.window, plan.pitch), plan.far),
    ]
    return _methods([*sentences, checked], [HARWIT] if plan.is_by_codes else None)


def _purposes(plan: Plan) -> str:
    """Return in words how many photos served which purpose."""
    if plan.is_by_codes:
        return ", ".join(f"{count} {sort}" for sort, count in count_by_sort(plan).items())
    return ", ".join(f"{count} {PURPOSES[name]}" for name, count in plan.counts.items() if count)


def any_patterns_methods(
    transport: StoredTransport | Transport,
    plan: Plan,
    verdict: KeptVerdict,
    *,
    correspondence_given: bool = False,
) -> Methods:
    """Return how a transport of anybody's patterns, or of free rows, was estimated and checked.

    Parameters
    ----------
    transport : StoredTransport or Transport
    plan : Plan
        Of the photos that it was reconstructed from.
    verdict : KeptVerdict
        On the transport.
    correspondence_given : bool
        Whether q was given, and not found in the photos.
    """
    is_free = "free" in transport.parts
    lights = "lamps" if is_free else "projector pixels"
    found = (
        "The lamp that lights each camera pixel directly, if one stands out,"
        if is_free
        else "The projector pixel that lights each camera pixel directly"
    )
    how = "was known beforehand" if correspondence_given else "was found by the same photos"
    sentences = [
        f"The light transport from {plan.projector.pixels} {lights} ({plan.projector}) to a camera "
        f"of {transport.camera} pixels ({counted(transport.channels, 'channel')}) was estimated "
        f"from {counted(len(plan.patterns), 'photo')} of known patterns.",
        f"{found} {how}.",
        _estimate_of_free_rows(is_least_squares=not transport.has_error_bars)
        if is_free
        else _model(describe_window(plan.window, plan.pitch)) + ESTIMATE_FROM_PATTERNS,
    ]
    return _methods([*sentences, _checked_by(verdict)], cites_paper=not is_free)


def _estimate_of_free_rows(*, is_least_squares: bool) -> str:
    by = (
        "least squares, without any prior."
        if is_least_squares
        else "the mean of a Gaussian posterior whose prior lets lamps differ by a variance that "
        "the photos choose [1]; its covariance gives the error bars."
    )
    return (
        f"Light from each lamp at each camera pixel was estimated as a number of its own, by {by}"
    )


def _model(window: str) -> str:
    return (
        f"Light was taken to be the sum of direct light, near-range light from a window of "
        f"{window} about it, and far-range light of low frequencies, as in [1]. "
    )


def _checked_by(verdict: KeptVerdict) -> str:
    """Return in a sentence what held-out photos say of a transport, or that there are none."""
    if verdict.held_out_snr is None:
        return checked_by_photos(None)
    beside = ""
    if verdict.expected_snr is not None:
        beside = f"; its error bars expect {verdict.expected_snr:.1f} dB"
    least = "at least " if verdict.is_least else ""
    return (
        f"Photos that were left out of an estimate of a sample of camera pixels ("
        f"{verdict.checked_by}) were foretold with an SNR_b of {least}"
        f"{in_words(verdict.held_out_snr)}{beside}."
    )


def checked_by_photos(held_out: HeldOut | None) -> str:
    """Return in a sentence what check photos say of a transport, or that there are none."""
    if held_out is None:
        return "The transport was not compared with photos that the estimate had not used."
    expected = held_out.expected_snr
    beside = "" if expected is None else f"; its error bars expect {expected:.1f} dB"
    use = "no estimate used"
    if held_out.called != PICTURES:
        use = "served to find q, but no response was estimated from"
    least = "at least " if held_out.is_least else ""
    return (
        f"Relit under {counted(len(held_out.lights), 'pattern')} whose photos {use}, the transport "
        f"has a mean SNR_b of {least}{in_words(held_out.snr)}{beside}."
    )


def _correspondence(plan: Plan, *, given: bool) -> str:
    which = "The projector pixel that lights each camera pixel directly"
    if given or plan.correspondence == "none":
        return f"{which} was known beforehand."
    how = CORRESPONDENCES.get(plan.correspondence, f"by the method {plan.correspondence}")
    if plan.is_by_codes and plan.correspondence == "phase":
        how = "by the phase of the responses to sinusoids"
    return f"{which} was found {how}."


def _estimate(provenance: Mapping[str, Any], window: str, far: Size) -> str:
    method = provenance["method"]
    parts = (
        f"Light was taken to be the sum of direct light, near-range light from a window of "
        f"{window} about it, and far-range light in a band of {far} "
        f"frequencies"
    )
    parts += " and at the others that were measured. " if method == "joint" else ". "
    text = parts + ESTIMATES.get(method, f"Each camera pixel's row was estimated by {method!r}.")
    if provenance["square"]:
        text += " Camera pixels were averaged by the projector pixel that lights them."
    return text


def evaluation_methods(provenance: Mapping[str, Any], lights: int, *, by_truth: bool) -> Methods:
    """Return how a transport was evaluated.

    Parameters
    ----------
    provenance : mapping
        Of the transport.
    lights : int
        Lights that it was relit under.
    by_truth : bool
        Whether the true transport was known, and not photos alone.
    """
    plan = provenance.get("plan")
    sentences = []
    if isinstance(plan, Mapping) and provenance.keys() >= {"method", "square"}:
        sentences = [
            f"The light transport was measured from {plan['photos']} photos by frequency-space "
            f"decomposition [1].",
            _estimate(
                provenance,
                describe_window(plan["window"], plan.get("pitch", 1)),
                Size(*plan["far"]),
            ),
        ]
    known = "those of the known transport" if by_truth else "photos that no estimate used"
    sentences.append(
        f"Pictures relit under {counted(lights, 'light')} were compared with {known}: SNR_b is 20 "
        f"log10 of the norm of the known picture over the norm of the difference."
    )
    if by_truth:
        sentences.append("SNR_t is the same of a camera pixel's row of the transport.")
    return _methods(sentences)


def check_methods(check: ModelCheck) -> Methods:
    """Return how it was checked where the model holds."""
    return _methods(
        [
            f"A known light transport was compared with the model of [1], direct light, near-range "
            f"light in a window of {check.window} x {check.window} projector pixels and up to "
            f"{check.k_near:.3f} cycles per projector pixel, and far-range light in a band of "
            f"{check.far} frequencies, at {check.camera_pixels} camera pixels; and with the best "
            f"that the model can do there without noise."
        ]
    )


def comparison_methods(comparison: Comparison) -> Methods:
    """Return how methods were compared."""
    trials = (*comparison.equal_photos, *comparison.equal_exposure)
    names = [name for name in RIVALS if any(trial.method == name for trial in trials)]
    references = list(
        dict.fromkeys(REFERENCES_OF_RIVALS[name] for name in names if name in REFERENCES_OF_RIVALS)
    )
    cited = []
    for name in names:
        reference = REFERENCES_OF_RIVALS.get(name)
        place = "" if reference is None else f" [{3 + references.index(reference)}]"
        cited.append(RIVALS[name].title + place)
    budgets = sorted({trial.budget for trial in comparison.equal_photos})
    return _methods(
        [
            f"Methods ({', '.join(cited) or 'none'}) photographed a simulated scene, "
            f"{comparison.scene}, of {comparison.projector} projector pixels and "
            f"{comparison.camera} camera pixels, with the same camera and noise, within "
            f"{', '.join(map(str, budgets)) or 'no'} photos, and within total exposures of as many "
            f"photos' worth.",
            "Transports were relit under five pictures, white and a random pattern, and compared "
            "by SNR_b [1] with the true pictures.",
        ],
        references,
    )


def figures_methods() -> Methods:
    """Return how the paper's figures were drawn again."""
    return _methods(
        [
            "The experiments of [1] were done again on simulated scenes, whose light transport is "
            "known exactly, and compressive light transport [3] beside them."
        ],
        [PEERS],
    )


def counted(number: int, noun: str) -> str:
    """Return a number with its noun, in the plural unless it is 1."""
    return f"{number} {noun}{'s' * (number != 1)}"


def _methods(
    sentences: list[str], further: list[str] | None = None, *, cites_paper: bool = True
) -> Methods:
    references = [*([PAPER] if cites_paper else []), software_reference()]
    text = " ".join([*sentences, f"The software was nearfar {version()} [{len(references)}]."])
    return Methods(text, (*references, *(further or [])))
