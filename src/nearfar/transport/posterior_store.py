"""Posteriors in the files of transports: what all camera pixels share, and names of arrays."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import zarr

from nearfar.arrays import Floats, Size
from nearfar.files.stores import add_array, open_array, read_selection
from nearfar.illumination.frequencies import frequency_from_text, frequency_to_text
from nearfar.illumination.real_basis import real_basis
from nearfar.priors.component import PriorComponent
from nearfar.transport.posterior import PatternPosterior, Posterior
from nearfar.transport.rows import FIELDS

# Numbers of a prior component, and its lengths but for 0: with others, numbers under- or overflow.
LARGEST_OF_COMPONENT = 1e6
LEAST_LENGTH = 0.05

# What a posterior from any patterns says that it is of; that of a joint estimate says nothing.
OF_PATTERNS = "patterns"
# Some fields have older names in the format.
STORED_FIELDS = {"prior_component": "kind", "prior_scale": "strength"}


def array_name(part: str, field: str) -> str:
    """Return the name in the file of a field of an optional part."""
    return f"{part}_{STORED_FIELDS.get(field, field)}"


def described(posterior: Posterior | PatternPosterior) -> dict[str, Any]:
    """Return the metadata of a posterior that all camera pixels share, as JSON types."""
    components = {"kinds": [list(component) for component in posterior.prior_components]}
    if isinstance(posterior, PatternPosterior):
        return {**components, "of": OF_PATTERNS}
    return {
        **components,
        "frequencies": [frequency_to_text(k) for k in posterior.frequencies],
        "repeats": [float(count) for count in posterior.multiplicity],
    }


def add_patterns(group: zarr.Group, part: str, patterns: Floats) -> None:
    """Write the patterns of a posterior, (N, P)."""
    array = add_array(
        group, array_name(part, "patterns"), patterns.shape, np.float32, patterns.shape
    )
    array[:] = patterns


@dataclass(frozen=True, eq=False)
class SharedPosterior:
    """What all camera pixels share of a posterior in a file.

    Attributes
    ----------
    kind : type
        `Posterior` or `PatternPosterior`.
    shared : mapping
        Values of its fields.
    """

    kind: type[Posterior] | type[PatternPosterior]
    shared: Mapping[str, Any]

    def arrays(self, part: str) -> list[str]:
        """Return the names of the arrays of its other fields."""
        return [array_name(part, name) for name in FIELDS[self.kind]]

    def of(self, read: dict[str, Any], part: str) -> Posterior | PatternPosterior:
        """Return the posterior of some camera rows, whose arrays are taken out of `read`."""
        fields = {name: read.pop(array_name(part, name)) for name in FIELDS[self.kind]}
        return self.kind(**self.shared, **fields)

    def fits(
        self, arrays: Mapping[str, Any], part: str, projector: Size, each: tuple[int, ...]
    ) -> bool:
        """Return whether arrays fit a transport of a projector, and factors of shape `each`."""
        flat = {"prior_component", "prior_scale", "variance_ratio"}
        fields = {name: arrays[array_name(part, name)] for name in FIELDS[self.kind]}
        if fields["prior_component"].dtype != np.uint8 or any(
            array.shape != (each[:2] if name in flat else each) for name, array in fields.items()
        ):
            return False
        if self.kind is PatternPosterior:
            return bool(self.shared["patterns"].shape[1:] == (projector.pixels,))
        count = real_basis(self.shared["frequencies"], projector).count
        return bool(self.shared["multiplicity"].shape == (count,))


def shared_posterior(attributes: dict[str, Any], group: zarr.Group, part: str) -> SharedPosterior:
    """Read what all camera pixels share of a posterior.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the metadata describe none.
    UnreadableFileError
        If its patterns are damaged.
    """
    components = tuple(map(_prior_component, listed(attributes["kinds"])))
    if attributes.get("of") == OF_PATTERNS:
        patterns = read_selection(open_array(group, array_name(part, "patterns")), ())
        return SharedPosterior(
            PatternPosterior, {"prior_components": components, "patterns": patterns}
        )
    return SharedPosterior(
        Posterior,
        {
            "prior_components": components,
            "frequencies": tuple(frequency_from_text(k) for k in listed(attributes["frequencies"])),
            "multiplicity": np.array(_finite(attributes["repeats"]), dtype=np.float32),
        },
    )


def _prior_component(value: Any) -> PriorComponent:
    """Read a prior component; ValueError or TypeError if there can be none such."""
    component = PriorComponent(*_finite(value))
    lengths = {component.near_reach, component.far_decay} - {0.0}
    if (
        not 0 <= min(component) <= max(component) <= LARGEST_OF_COMPONENT
        or component.far_decay == 0
        or min(lengths) < LEAST_LENGTH
    ):
        raise ValueError(f"{component} is no prior component")
    return component


def _finite(value: Any) -> list[float]:
    """Return the numbers of a JSON list; ValueError or TypeError if it is none, or one is not."""
    numbers = [float(number) for number in listed(value)]
    if not all(map(math.isfinite, numbers)):
        raise ValueError("a number is not finite")
    return numbers


def listed(value: Any) -> list[Any]:
    """Return a JSON list; TypeError if it is none."""
    if not isinstance(value, list):
        raise TypeError(f"{value!r} is no list")
    return value
