"""Drawings of a transport."""

from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.axes import Axes

from nearfar.arrays import Size
from nearfar.errors import InputError
from nearfar.files import to_srgb
from nearfar.transport.quality import Quality
from tests.worlds import model_transport


@pytest.fixture(autouse=True)
def _close():
    mpl.use("agg")
    yield
    pyplot.close("all")


@pytest.fixture(params=[1, 2, 3, 4])
def transport(request):
    return model_transport(
        Size(9, 12), Size(7, 8), window=3, far=Size(3, 3), channels=request.param
    )


def test_a_relit_picture_is_drawn_as_it_is(transport):
    light = np.ones(transport.projector)
    ax = transport.plot.relit(light, exposure=0.5)
    assert isinstance(ax, Axes)
    drawn = ax.images[0].get_array()
    picture = (transport @ light).reshape(7, 8, -1)
    known = picture[..., :3] if picture.shape[2] >= 3 else picture.mean(axis=-1)
    np.testing.assert_allclose(drawn, to_srgb(0.5 * known), atol=1e-5)


def test_every_drawing_takes_axes_and_returns_them(transport):
    plot = transport.plot
    for draw in (
        lambda ax: plot.relit(np.ones(transport.projector), ax=ax),
        lambda ax: plot.correspondence("y", ax=ax),
        lambda ax: plot.row(3, 4, ax=ax),
        lambda ax: plot.transport_row(3, 4, ax=ax),
        lambda ax: plot.spectrum(3, 4, ax=ax),
        lambda ax: plot.column(2, 5, ax=ax),
    ):
        _, given = pyplot.subplots()
        assert draw(given) is given
        assert given.get_title()
    three = plot.components(np.ones(transport.projector))
    assert [ax.get_title() for ax in three] == ["direct", "near", "far"]
    assert plot.components(np.ones(transport.projector), ax=three) == three


def test_a_row_draws_what_the_pixel_responses(transport):
    ax = transport.plot.row(3, 4)
    q = np.rint(transport.correspondence[3, 4]).astype(int)
    direct = ax.lines[0].get_ydata()
    row = transport.component_rows(slice(3 * 8 + 4, 3 * 8 + 5)).direct[0].mean(axis=0)
    np.testing.assert_allclose(direct, row.reshape(9, 12)[q[0]])
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["direct", "near", "far"]


def test_a_row_has_a_band_of_one_deviation_of_the_mean_of_channels(transport):
    q = np.rint(transport.correspondence[3, 4]).astype(int)
    asked = []

    class Errors:
        def along(self, pixel, line):
            asked.append((pixel, line))
            return [np.full((transport.channels, 12), off) for off in (0.1, 0.2, 0.3)]

    ax = transport.plot.row(3, 4, errors=Errors())
    assert asked == [(3 * 8 + 4, q[0])]
    for line, band, off in zip(ax.lines, ax.collections, (0.1, 0.2, 0.3), strict=True):
        top = band.get_paths()[0].vertices[:, 1].max()
        expected = line.get_ydata().max() + off / np.sqrt(transport.channels)
        assert top == pytest.approx(expected)


@pytest.mark.parametrize("draw", ["row", "transport_row", "spectrum", "column"])
def test_pixels_that_are_not_there_get_a_sentence(transport, draw):
    for y, x in ((9, 0), (-1, 3), (0, 12)):
        with pytest.raises(InputError, match="is no pixel of the"):
            getattr(transport.plot, draw)(y, x)


def test_other_bad_input(transport):
    with pytest.raises(InputError, match="give 'x' or 'y'"):
        transport.plot.correspondence("z")
    with pytest.raises(InputError, match="give 3"):
        transport.plot.components(np.ones(transport.projector), ax=[])


class KnownErrors:
    """Error bars that are infinite at every camera pixel."""

    def along(self, pixel, line):
        return tuple(np.full((1, 12), np.inf, dtype=np.float32) for _ in range(3))


def test_saturated_camera_pixels_are_marked_and_their_errors_said_to_be_unknown():
    transport = model_transport(Size(9, 12), Size(7, 8), window=3, far=Size(3, 3))
    saturated = np.zeros((7, 8), dtype=bool)
    saturated[6, 7] = True
    transport = replace(transport, quality=Quality(np.ones((7, 8), np.float32), saturated))
    ax = transport.plot.correspondence("x")
    drawn, marks = (image.get_array() for image in ax.images)
    np.testing.assert_array_equal(np.ma.getmaskarray(drawn) | np.isnan(drawn), saturated)
    np.testing.assert_array_equal(marks[..., 3] > 0, saturated)
    # The rightmost column is the saturated one's and others', but nothing beyond is in the scale.
    assert ax.images[0].get_clim()[1] == np.max(transport.correspondence[~saturated][:, 1])
    unknown = transport.plot.row(6, 7, errors=KnownErrors())
    assert "errors unknown" in unknown.get_title()
    assert unknown.patch.get_facecolor()[:3] == (0.9, 0.9, 0.9)
    known = transport.plot.row(6, 6)
    assert "unknown" not in known.get_title()
    assert known.patch.get_facecolor()[:3] != (0.9, 0.9, 0.9)
