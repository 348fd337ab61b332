"""Light that reaches the camera by way of nodes in the scene: a product of three thin factors.

Index convention: c is a camera pixel, p a projector pixel, i and j nodes. The projector's weights
take light to the nodes, `between` carries it from node to node, and the camera's weights take it
to the photo:

    A_cp = sum_ij camera_ci between_ij projector_pj.

`between` is symmetric, as light travels both ways alike, so that the adjoint swaps camera and
projector.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import fft, sparse

from nearfar.arrays import Complexes, Floats, blocks
from nearfar.errors import InputError
from nearfar.parallel import threads
from nearfar.transport.sparse_products import scaled, times, transposed_times


@dataclass(frozen=True, eq=False)
class DenseBetween:
    """Any symmetric transport between nodes.

    Attributes
    ----------
    matrices : ndarray, shape (channels, nodes, nodes), float32
        Symmetric.
    """

    matrices: Floats

    @property
    def channels(self) -> int:
        """Number of channels."""
        return int(self.matrices.shape[0])

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return int(self.matrices.shape[1])

    def carry(self, light: Floats) -> Floats:
        """Carry light from node to node.

        Parameters
        ----------
        light : ndarray, shape (n, channels or 1, nodes), float32

        Returns
        -------
        ndarray, shape (n, channels, nodes), float32
        """
        carried = np.empty((len(light), self.channels, self.nodes), dtype=np.float32)
        for channel, matrix in enumerate(self.matrices):
            carried[:, channel] = light[:, min(channel, light.shape[1] - 1)] @ matrix
        return carried


@dataclass(frozen=True, eq=False)
class ConvolvedBetween:
    """Transport that depends on the distance alone, between nodes on a lattice in space.

    Attributes
    ----------
    lattice : tuple of int
        Nodes along each axis.
    spectra : ndarray, shape (channels, *half spectrum), float32
        Real DFT of the kernel over at least twice the lattice, so that nothing wraps around.
    padded : tuple of int
        Sides of that DFT.
    """

    lattice: tuple[int, int, int]
    spectra: Floats
    padded: tuple[int, int, int]

    @property
    def channels(self) -> int:
        """Number of channels."""
        return int(self.spectra.shape[0])

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return int(np.prod(self.lattice))

    def carry(self, light: Floats) -> Floats:
        """Carry light from node to node; see `DenseBetween.carry`."""
        carried = np.empty((len(light), self.channels, self.nodes), dtype=np.float32)
        for one, out in zip(light, carried, strict=True):
            for channel in range(self.channels):
                # One spectrum serves all channels of a grey light.
                if channel < len(one):
                    spectrum = self._spectrum(one[channel].reshape(self.lattice))
                out[channel] = self._on_lattice(spectrum * self.spectra[channel]).ravel()
        return carried

    def _spectrum(self, values: Floats) -> Complexes:
        """Real DFT of values on the lattice, axis by axis: most of the padding stays out."""
        deep, high, wide = self.padded
        spectrum = fft.rfft(values, wide, axis=2, workers=threads())
        spectrum = fft.fft(spectrum, high, axis=1, workers=threads())
        return np.asarray(fft.fft(spectrum, deep, axis=0, workers=threads()))

    def _on_lattice(self, spectrum: Complexes) -> Floats:
        """Inverse of `_spectrum`, on the lattice alone."""
        deep, high, _ = self.lattice
        values = fft.ifft(spectrum, axis=0, workers=threads(), overwrite_x=True)[:deep]
        values = fft.ifft(values, axis=1, workers=threads())[:, :high]
        wide = self.padded[2]
        return np.asarray(
            fft.irfft(values, wide, axis=2, workers=threads())[..., : self.lattice[2]]
        )


# Rows that are made dense at once.
ROWS_AT_ONCE = 16

Between = DenseBetween | ConvolvedBetween


@dataclass(frozen=True, eq=False)
class Mediated:
    """Transport by way of nodes.

    Attributes
    ----------
    camera : scipy.sparse.csr_array, shape (C, nodes), float32
        Weight of each node in each camera pixel.
    projector : scipy.sparse.csr_array, shape (P, nodes), float32
        Light that each projector pixel sends to each node.
    between : DenseBetween or ConvolvedBetween

    Raises
    ------
    InputError
        If the weights are of other nodes.
    """

    camera: sparse.csr_array
    projector: sparse.csr_array
    between: Between

    def __post_init__(self) -> None:
        for matrix in (self.camera, self.projector):
            if matrix.shape[1] != self.between.nodes:
                raise InputError(
                    f"the weights are of {matrix.shape[1]} nodes and the transport between them of "
                    f"{self.between.nodes}: give those of the same nodes."
                )

    @property
    def reversed(self) -> "Mediated":
        """The adjoint: camera and projector change places."""
        return replace(self, camera=self.projector, projector=self.camera)

    def scaled(self, factor: float) -> "Mediated":
        """Return the transport times a factor."""
        return replace(self, camera=scaled(self.camera, factor))

    def pictures(self, lights: Floats) -> Floats:
        """Light the scene.

        Parameters
        ----------
        lights : ndarray, shape (n, channels or 1, P), float32

        Returns
        -------
        ndarray, shape (n, channels, C), float32
        """
        count, given, pixels = lights.shape
        columns = np.ascontiguousarray(lights.reshape(count * given, pixels).T)
        fallen = transposed_times(self.projector, columns).T.reshape(count, given, -1)
        carried = self.between.carry(np.ascontiguousarray(fallen))
        flat = np.ascontiguousarray(carried.reshape(count * self.between.channels, -1).T)
        return times(self.camera, flat).T.reshape(count, self.between.channels, -1)

    def rows(self, pixels: slice) -> Floats:
        """Return dense rows of camera pixels, (n, channels, P), float32."""
        seen = self.camera[pixels]
        channels = self.between.channels
        rows = np.zeros((seen.shape[0], channels, self.projector.shape[0]), dtype=np.float32)
        # Pixels that see no node stay 0.
        reached = np.flatnonzero(np.diff(seen.indptr))
        for some in blocks(len(reached), ROWS_AT_ONCE):
            carried = self.between.carry(seen[reached[some]].toarray()[:, None])
            flat = carried.reshape(-1, self.between.nodes).T
            found = times(self.projector, np.ascontiguousarray(flat)).T
            rows[reached[some]] = found.reshape(-1, channels, self.projector.shape[0])
        return rows
