"""Typical scenes, for which plans are made, as mixtures of prior components."""

from typing import NamedTuple

import numpy as np

from nearfar.arrays import Floats
from nearfar.priors.component import PriorComponent


class TypicalScenes(NamedTuple):
    """Scenes, each a mixture of camera pixels of some prior components.

    Attributes
    ----------
    prior_components : tuple of (PriorComponent, float)
        With the prior scale, as a share of white.
    shares : ndarray, shape (scenes, components), float64
        Share of each scene's squared light that is of each component.
    weights : ndarray, shape (scenes,), float64
        How much a decibel of each scene counts.
    """

    prior_components: tuple[tuple[PriorComponent, float], ...]
    shares: Floats
    weights: Floats


def typical_scenes(
    weights: tuple[float, ...], *rows: tuple[PriorComponent, float, tuple[float, ...]]
) -> TypicalScenes:
    """Return scenes from a table with a row for each prior component and scale.

    Parameters
    ----------
    weights : tuple of float
        How much a decibel of each scene counts.
    *rows : tuple
        A prior component, its scale, and its share of each scene.
    """
    return TypicalScenes(
        tuple((prior_component, scale) for prior_component, scale, _ in rows),
        np.array([shares for *_, shares in rows]).T,
        np.array(weights),
    )
