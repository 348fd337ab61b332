"""Choose the prior component and scale of camera pixels by their evidence."""

from math import log

from array_api_compat import device

from nearfar.arrays import Booleans, Floats, Integers, namespace
from nearfar.estimate.joint.batch import PixelBatch
from nearfar.estimate.joint.evidence import (
    best_between_scales,
    best_of,
    log_evidence,
    log_evidence_by_row,
    log_evidences,
)
from nearfar.estimate.joint.pooled_choice import no_probabilities, put_probabilities
from nearfar.estimate.joint.problem import ComponentChoice, Model
from nearfar.estimate.joint.unmeasured import log_scores
from nearfar.illumination.centred_basis import CentredBasis
from nearfar.priors.fitted import LIT_COMPONENTS

# Where direct light explains this share of the power of the responses, it is there.
CERTAIN_SHARE = 0.5


def choose(
    batch: PixelBatch, model: Model, given: ComponentChoice | None, *, is_first: bool
) -> tuple[ComponentChoice, Floats]:
    """Choose prior components where they are not given.

    In the first sweep a camera pixel for which q was found may turn out to have no direct light.

    Returns
    -------
    choice : ComponentChoice
    probability : ndarray, shape (n or 0, components, scales)
        In the first sweep, of all components and scales where they are not given; elsewhere 0.
    """
    xp = namespace(batch.white)
    if given is None:
        left = xp.ones_like(batch.lit)
        number = xp.zeros(left.shape, dtype=xp.int64, device=device(left))
        given = ComponentChoice(number, xp.zeros_like(batch.white[:, 0]))
    else:
        # Chosen when the camera pixel was lit and is not now, or the reverse.
        left = batch.lit != (given.prior_component < len(LIT_COMPONENTS))
    probability = no_probabilities(len(left) if is_first else 0, model, batch.white)
    # No shift of q has a say; nor has, among functions of several projector pixels, the references'
    # error, which takes a third of the time and changes no choice that matters.
    batch = batch._replace(direct_weights=batch.direct_weights[:, :1])
    evidence_of = log_evidence
    if model.centred.near_basis.pitch > 1:
        batch = batch._replace(of_offset=batch.of_offset[:, :0])
        evidence_of = log_evidence_by_row
    for selected, candidates in (
        (left & batch.lit, model.lit if is_first else model.lit_differences),
        (left & ~batch.lit, model.unlit),
    ):
        (mine,) = xp.nonzero(selected)
        if not len(mine):
            continue
        of_mine = batch if len(mine) == len(left) else batch.only(mine)
        values = log_evidences(of_mine, candidates, evidence_of)
        best = best_between_scales if candidates is model.unlit else best_of
        component, scale, evidence = best(values, candidates)
        if is_first and candidates is model.lit:
            put_probabilities(probability, mine, values, candidates, model)
        elif is_first:
            _put_unlit(probability, mine, of_mine, values, model)
        if is_first and candidates is model.lit:
            (doubted,) = xp.nonzero(is_doubtful(of_mine, model.centred))
            if len(doubted):
                dark_ones = _without_direct(of_mine.only(doubted))
                values = log_evidences(dark_ones, model.unlit, evidence_of)
                unlit, its_scale, without = best_between_scales(values, model.unlit)
                # q was chosen among all projector pixels.
                none = without > evidence[doubted] - log(model.centred.basis.projector.pixels)
                component[doubted] = xp.where(none, unlit, component[doubted])
                scale[doubted] = xp.where(none, its_scale, scale[doubted])
                (dark,) = xp.nonzero(none)
                of_dark, its_values = dark_ones.only(dark), values[:, none]
                _put_unlit(probability, mine[doubted[dark]], of_dark, its_values, model)
        given.prior_component[mine] = component
        given.prior_scale[mine] = xp.astype(scale, xp.float32)
    return given, probability


def _put_unlit(
    probability: Floats, selected: Integers, batch: PixelBatch, values: Floats, model: Model
) -> None:
    """Set the probabilities of camera pixels without direct light.

    Where functions are of several projector pixels, error bars are those of the estimate's choice.
    """
    if model.centred.near_basis.pitch == 1:
        values = log_scores(batch, model.unlit, model.multiplicity, model.stood_for)
    put_probabilities(probability, selected, values, model.unlit, model)


def is_doubtful(batch: PixelBatch, centred: CentredBasis) -> Booleans:
    """Return at which camera pixels direct light explains little of the responses, shape (n,)."""
    xp = namespace(batch.responses)
    direct = centred.of_direct(batch.direct_weights[:, :1])
    along = xp.sum(batch.responses * direct, axis=-1) ** 2
    power = xp.sum(batch.responses**2, axis=-1) * xp.sum(direct**2, axis=-1)
    doubtful: Booleans = xp.sum(along, axis=1) < CERTAIN_SHARE * xp.sum(power, axis=1)
    return doubtful


def _without_direct(batch: PixelBatch) -> PixelBatch:
    return batch._replace(direct_weights=batch.direct_weights[:, :1] * 0.0)
