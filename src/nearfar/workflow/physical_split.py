"""How close a physical split comes to the physical components of a known scene."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from nearfar.checks import as_number
from nearfar.estimate.physical import PhysicalSplit
from nearfar.transport.known import KnownTransport
from nearfar.workflow.evaluate import require_same_kind, snr


class PhysicalSnr(NamedTuple):
    """Physical components under floodlight beside those of the scene.

    Attributes
    ----------
    components : mapping
        SNR of ``direct``, ``subsurface`` and ``interreflection``, dB; those that the scene does not
        have are left out.
    subsurface_share : float
        Share of all light that the split takes for subsurface light.
    """

    components: Mapping[str, float]
    subsurface_share: float


def physical_snr(
    split: PhysicalSplit, truth: KnownTransport, *, exposure: float = 1.0
) -> PhysicalSnr:
    """Compare physical components under full white with those of the scene.

    Parameters
    ----------
    split : PhysicalSplit
    truth : ExactTransport or ExactOperator
        Of known components.
    exposure : float
        Photo units per unit of the truth.

    Returns
    -------
    PhysicalSnr

    Raises
    ------
    InputError
        If sizes differ, or the truth's components are not known apart.
    """
    require_same_kind(split.transport, truth)
    factor = np.float32(as_number(exposure, "the exposure"))
    white = np.ones(truth.projector, dtype=np.float32)
    found = split.components(white)
    known = dict(zip(found._fields, truth.component_pictures(white), strict=True))
    components = {
        name: snr(factor * picture, getattr(found, name).reshape(picture.shape))
        for name, picture in known.items()
        if picture.any()
    }
    total = float(sum(part.sum() for part in found))
    return PhysicalSnr(components, float(found.subsurface.sum()) / total if total else 0.0)
