"""Drawings of a transport: ``transport.plot.relit(light)`` and others, as matplotlib axes.

Each method draws on the given axes, or on new ones, and returns the axes.
"""

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from nearfar.arrays import Booleans, Floats
from nearfar.checks import as_place
from nearfar.errors import InputError
from nearfar.files import to_srgb
from nearfar.markup import MARK
from nearfar.transport import near
from nearfar.transport.apart import Apart
from nearfar.transport.band import Banded, band_edge
from nearfar.transport.parts import PLACES, Parts
from nearfar.transport.posterior import deviation_of_mean
from nearfar.transport.quality import Quality

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Decades of the colour scale of a logarithmic picture.
COLOUR_SCALE_DECADES = 5.0
# Decades of the vertical axis of a line, below its largest value.
LINE_DECADES = 6.0
# Behind lines whose errors are unknown.
UNKNOWN_COLOUR = "0.9"


class Drawable(Apart, Banded, Protocol):
    """The attributes of `nearfar.Transport` that the drawings need."""

    @property
    def quality(self) -> Quality | None:
        """Which camera pixels are saturated, where the photos show it."""

    def __matmul__(self, light: Floats) -> Floats: ...

    @property
    def parts(self) -> Parts:
        """What T is split into."""

    def components(self, light: Floats) -> Any:
        """Return the pictures of D, N and F."""

    def rows(self, pixels: slice) -> Floats:
        """Return rows of T, (n, channels, P)."""

    def column(self, y: int, x: int) -> Floats:
        """Return the picture under one projector pixel."""


class _ErrorsAlong(Protocol):
    """Standard deviations along a row of the projector, as `nearfar.ErrorBars` returns them."""

    def along(self, pixel: int, line: int) -> Any:
        """Return the standard deviations of D, N and F, each (channels, Px)."""


def colours(picture: Floats) -> Floats:
    """Convert a picture with any number of channels into one with 1 or 3, for display."""
    if picture.ndim == 2 or picture.shape[2] == 3:
        return picture
    return picture[..., :3] if picture.shape[2] > 3 else np.asarray(picture.mean(axis=-1))


class Plots:
    """Drawings of one transport, as `Transport.plot`.

    Parameters
    ----------
    transport : Transport
    """

    def __init__(self, transport: Drawable) -> None:
        self._transport = transport

    def relit(self, light: Floats, *, exposure: float = 1.0, ax: "Axes | None" = None) -> "Axes":
        """Draw the picture under a light, as sRGB.

        Parameters
        ----------
        light : ndarray, shape (Py, Px) or (Py, Px, channels)
        exposure : float
            Factor on the photo units.
        ax : Axes, optional
        """
        return _show(_axes(ax), exposure * (self._transport @ light), "relit")

    def components(
        self, light: Floats, *, exposure: float = 1.0, ax: "list[Axes] | None" = None
    ) -> "list[Axes]":
        """Draw the relit direct, near- and far-range pictures, on an axis for each part."""
        components = self._transport.components(light)
        parts = {name: components[PLACES[name]] for name in self._transport.parts}
        if ax is None:
            from matplotlib import pyplot

            made = pyplot.subplots(
                1, len(parts), figsize=(3 * len(parts), 3.2), layout="constrained", squeeze=False
            )
            ax = list(made[1][0])
        if len(ax) != len(parts):
            raise InputError(
                f"{len(ax)} axes were given for the components {', '.join(parts)}: give "
                f"{len(parts)}."
            )
        return [
            _show(each, exposure * part, name)
            for each, (name, part) in zip(ax, parts.items(), strict=True)
        ]

    def correspondence(self, axis: str = "x", *, ax: "Axes | None" = None) -> "Axes":
        """Draw q: the projector's column ("x") or row ("y") that lights each camera pixel.

        Saturated camera pixels are marked, and left out of the colour scale.
        """
        if axis not in {"x", "y"}:
            raise InputError(f"{axis!r} is no axis of q: give 'x' or 'y'.")
        drawn = _axes(ax)
        saturated = self._saturated()
        q = self._transport.correspondence[..., "yx".index(axis)]
        image = drawn.imshow(np.where(saturated, np.nan, q), cmap="viridis")
        drawn.figure.colorbar(image, ax=drawn, label=f"q along {axis}, projector pixels")
        if saturated.any():
            marks = np.zeros((*saturated.shape, 4), dtype=np.uint8)
            marks[saturated] = (*MARK, 255)
            drawn.imshow(marks)
            drawn.set_xlabel("red: saturated")
        return _bare(drawn, "correspondence")

    def row(
        self,
        y: int,
        x: int,
        *,
        errors: _ErrorsAlong | None = None,
        ax: "Axes | None" = None,
    ) -> "Axes":
        """Draw how a camera pixel responds along the projector's row through its q.

        Parameters
        ----------
        y, x : int
            Camera pixel.
        errors : ErrorBars, optional
            Adds a band of one standard deviation of the mean over channels, whose errors are taken
            to be independent; over the whole plot at a saturated camera pixel, of which nothing is
            known.
        ax : Axes, optional
        """
        transport, pixel = self._transport, self._pixel(y, x)
        height, width = transport.projector
        line = near.line_through(transport.correspondence[y, x], transport.projector)
        drawn = _axes(ax)
        rows = transport.component_rows(pixel)
        bars = errors.along(pixel.start, line) if errors is not None else None
        for name in transport.parts:
            number = PLACES[name]
            values = rows[number]
            level = np.abs(values[0].mean(axis=0).reshape(height, width)[line])
            (drawn_line,) = drawn.semilogy(level, label=name)
            if bars is not None and np.isfinite(bars[number]).all():
                off = deviation_of_mean(bars[number])
                low = np.maximum(level - off, 1e-12)
                drawn.fill_between(
                    np.arange(width), low, level + off, alpha=0.25, color=drawn_line.get_color()
                )
        drawn.set(xlabel=f"projector column, row {line}", ylabel="transport, photo units")
        most = max(float(np.abs(part).max()) for part in rows)
        drawn.set_ylim(bottom=most * 10.0**-LINE_DECADES if most > 0 else None)
        is_saturated = bool(self._saturated()[y, x])
        if is_saturated and bars is not None:
            drawn.patch.set_facecolor(UNKNOWN_COLOUR)
        says = ", saturated: errors unknown" if is_saturated else ""
        drawn.set_title(f"camera pixel ({y}, {x}){says}")
        drawn.legend()
        return drawn

    def transport_row(self, y: int, x: int, *, ax: "Axes | None" = None) -> "Axes":
        """Draw a camera pixel's row of T over the projector, in a logarithmic scale."""
        transport = self._transport
        row = transport.rows(self._pixel(y, x))[0].mean(axis=0).reshape(transport.projector)
        drawn = _logarithm(_axes(ax), row)
        return _bare(drawn, f"row of camera pixel ({y}, {x})")

    def spectrum(self, y: int, x: int, *, ax: "Axes | None" = None) -> "Axes":
        """Draw the spectrum of a camera pixel's row, DC in the middle, with a frame at k_far."""
        transport = self._transport
        height, width = transport.projector
        row = transport.rows(self._pixel(y, x))[0].mean(axis=0).reshape(height, width)
        size = np.abs(np.fft.fftshift(np.fft.fft2(row)))
        decibels = 20 * np.log10(np.maximum(size / max(size.max(), 1e-30), 1e-6))
        drawn = _axes(ax)
        image = drawn.imshow(
            decibels, extent=(-0.5, 0.5, 0.5, -0.5), cmap="magma", vmax=0, aspect="auto"
        )
        drawn.figure.colorbar(image, ax=drawn, label="dB below its largest")
        ky, kx = band_edge(transport)
        drawn.plot([-kx, kx, kx, -kx, -kx], [-ky, -ky, ky, ky, -ky], color="white", label="k_far")
        drawn.set(xlabel="fx, cycles per projector pixel", ylabel="fy")
        drawn.set_title(f"spectrum of camera pixel ({y}, {x})")
        drawn.legend()
        return drawn

    def column(self, y: int, x: int, *, ax: "Axes | None" = None) -> "Axes":
        """Draw the picture under one projector pixel, in a logarithmic scale."""
        picture = self._transport.column(y, x)
        picture = picture if picture.ndim == 2 else picture.mean(axis=-1)
        return _bare(_logarithm(_axes(ax), picture), f"lit by projector pixel ({y}, {x})")

    def _saturated(self) -> Booleans:
        quality = self._transport.quality
        if quality is None:
            return np.zeros(self._transport.camera, dtype=bool)
        return quality.saturated

    def _pixel(self, y: int, x: int) -> slice:
        camera = self._transport.camera
        y, x = as_place(y, x, camera, "camera")
        return slice(y * camera.width + x, y * camera.width + x + 1)


def _axes(ax: "Axes | None") -> "Axes":
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained")[1]


def _show(ax: "Axes", picture: Floats, title: str) -> "Axes":
    ax.imshow(to_srgb(np.clip(colours(picture), 0, 1)), cmap="gray", vmin=0, vmax=1)
    return _bare(ax, title)


def _logarithm(ax: "Axes", values: Floats) -> "Axes":
    shown = np.log10(np.maximum(np.abs(values), 1e-30))
    high = float(shown.max())
    image = ax.imshow(shown, cmap="magma", vmin=high - COLOUR_SCALE_DECADES, vmax=high)
    ax.figure.colorbar(image, ax=ax, label="log10 of the transport")
    return ax


def _bare(ax: "Axes", title: str) -> "Axes":
    ax.set_xticks([])
    ax.set_yticks([])
    ax.set_title(title)
    return ax
