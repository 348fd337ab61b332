"""Posteriors in the files of transports: what all camera pixels share, and names of arrays."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import zarr

from nearfar.arrays import Floats, Size
from nearfar.illumination.frequencies import frequency_from_text, frequency_to_text
from nearfar.illumination.real_basis import real_basis
from nearfar.priors.component import PriorComponent
from nearfar.transport.matrix_store import read_padded, write_padded
from nearfar.transport.posterior import AnyPosterior, FreePosterior, PatternPosterior, Posterior
from nearfar.transport.rows import FIELDS

# Numbers of a prior component, and its lengths but for 0: with others, numbers under- or overflow.
LARGEST_OF_COMPONENT = 1e6
LEAST_LENGTH = 0.05

# What a posterior says that it is of, by its type; that of a joint estimate says nothing.
OF: Mapping[type[AnyPosterior], str] = {PatternPosterior: "patterns", FreePosterior: "free rows"}
# Arrays that all camera pixels share, each flat in the file.
SHARED: Mapping[type[AnyPosterior], tuple[str, ...]] = {
    PatternPosterior: ("patterns",),
    FreePosterior: ("modes", "strengths", "mean", "gain_errors"),
}
# Those of them with a row of projector pixels for each of something.
OF_PROJECTOR_PIXELS = {"patterns", "modes", "gain_errors"}
# Fields with a value for each camera pixel, whatever the channels.
OF_PIXELS = {"prior_component", "prior_scale", "variance_ratio"}
# Fields that files of older versions lack, and the values that they have there. The metadata names
# those that are there.
ADDED_FIELDS: Mapping[type[AnyPosterior], Mapping[str, float]] = {Posterior: {"noise_share": 1.0}}
# Some fields have older names in the format.
STORED_FIELDS = {"prior_component": "kind", "prior_scale": "strength"}


def array_name(part: str, field: str) -> str:
    """Return the name in the file of a field of an optional part."""
    return f"{part}_{STORED_FIELDS.get(field, field)}"


def described(posterior: AnyPosterior) -> dict[str, Any]:
    """Return the metadata of a posterior that all camera pixels share, as JSON types."""
    of = {"of": OF[type(posterior)]} if type(posterior) in OF else {}
    if isinstance(posterior, FreePosterior):
        return {**of, "mean_variance": posterior.mean_variance}
    components = {"kinds": [list(component) for component in posterior.prior_components]}
    if isinstance(posterior, PatternPosterior):
        return {**of, **components}
    return {
        **components,
        "frequencies": [frequency_to_text(k) for k in posterior.frequencies],
        "repeats": [float(count) for count in posterior.multiplicity],
        "added": list(ADDED_FIELDS[Posterior]),
    }


def write_shared(group: zarr.Group, part: str, posterior: AnyPosterior) -> None:
    """Write the arrays of a posterior that all camera pixels share."""
    for name in SHARED.get(type(posterior), ()):
        values = np.ravel(getattr(posterior, name)).astype(np.float32, copy=False)
        write_padded(group, array_name(part, name), values)


@dataclass(frozen=True, eq=False)
class SharedPosterior:
    """What all camera pixels share of a posterior in a file.

    Attributes
    ----------
    kind : type
        `Posterior`, `PatternPosterior` or `FreePosterior`.
    shared : mapping
        Values of its fields.
    lacking : mapping
        Those of its other fields that the file lacks, and the value that each has everywhere.
    """

    kind: type[AnyPosterior]
    shared: Mapping[str, Any]
    lacking: Mapping[str, float] = field(default_factory=dict)

    @property
    def _stored(self) -> list[str]:
        return [name for name in FIELDS[self.kind] if name not in self.lacking]

    def arrays(self, part: str) -> list[str]:
        """Return the names of the arrays of its other fields."""
        return [array_name(part, name) for name in self._stored]

    def of(self, read: dict[str, Any], part: str) -> AnyPosterior:
        """Return the posterior of some camera rows, whose arrays are taken out of `read`.

        Raises
        ------
        ValueError
            If it is of prior components that there are not.
        """
        fields = {name: read.pop(array_name(part, name)) for name in self._stored}
        fields |= {
            name: np.full(read["black"].shape, value, dtype=np.float32)
            for name, value in self.lacking.items()
        }
        if "prior_component" in fields:
            last = int(fields["prior_component"].max(initial=0))
            if last >= len(self.shared["prior_components"]):
                raise ValueError(f"there is no prior component {last}")
        return self.kind(**self.shared, **fields)

    def fits(
        self, arrays: Mapping[str, Any], part: str, projector: Size, each: tuple[int, ...]
    ) -> bool:
        """Return whether arrays fit a transport of a projector, and factors of shape `each`."""
        if self.kind is Posterior:
            count = real_basis(self.shared["frequencies"], projector).count
            if len(self.shared["multiplicity"]) != count:
                return False
        fields = {name: arrays[array_name(part, name)] for name in self._stored}
        if "prior_component" in fields and fields["prior_component"].dtype != np.uint8:
            return False
        return all(
            array.shape == (each[:2] if name in OF_PIXELS else each)
            for name, array in fields.items()
        )


def shared_posterior(
    attributes: dict[str, Any], group: zarr.Group, part: str, projector: Size
) -> SharedPosterior:
    """Read what all camera pixels share of the posterior of a transport of a projector.

    Raises
    ------
    KeyError, TypeError, ValueError
        If the metadata or the arrays are of none.
    UnreadableFileError
        If an array is missing or damaged.
    """
    of = attributes.get("of")
    kinds = [kind for kind, name in OF.items() if name == of] if of is not None else [Posterior]
    if not kinds:
        raise ValueError(f"{of!r} has no posterior")
    (kind,) = kinds
    shared: dict[str, Any] = {
        name: _read_shared(group, part, name, projector) for name in SHARED.get(kind, ())
    }
    if kind is FreePosterior:
        _require_alike(shared, projector)
        (shared["mean_variance"],) = _finite([attributes["mean_variance"]])
        if shared["mean_variance"] < 0:
            raise ValueError("a variance is below 0")
        return SharedPosterior(kind, shared)
    shared["prior_components"] = tuple(map(_prior_component, listed(attributes["kinds"])))
    if kind is Posterior:
        frequencies = tuple(frequency_from_text(k) for k in listed(attributes["frequencies"]))
        repeats = np.array(_finite(attributes["repeats"]), dtype=np.float32)
        shared |= {"frequencies": frequencies, "multiplicity": repeats}
    added = listed(attributes.get("added", []))
    lacking = {n: value for n, value in ADDED_FIELDS.get(kind, {}).items() if n not in added}
    return SharedPosterior(kind, shared, lacking)


def _read_shared(group: zarr.Group, part: str, name: str, projector: Size) -> Floats:
    """Read an array that all camera pixels share; ValueError if it is of another projector."""
    values: Floats = read_padded(group, array_name(part, name)).astype(np.float32)
    if not np.isfinite(values).all():
        raise ValueError(f"its {name} are not finite")
    return values.reshape(-1, projector.pixels) if name in OF_PROJECTOR_PIXELS else values


def _require_alike(shared: Mapping[str, Any], projector: Size) -> None:
    """Refuse arrays of free rows that do not fit one another; ValueError."""
    if len(shared["modes"]) != len(shared["strengths"]) or len(shared["mean"]) != projector.pixels:
        raise ValueError("its posterior of free rows is of another projector")


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
