"""Pages of several projectors before one camera: one for each, with a light of its own.

The page of each adds the pictures under the lights of the others to that of its own, as light adds
up.
"""

from collections.abc import Mapping, Sequence

from nearfar.packages import needed
from nearfar.report.maps import Map
from nearfar.viewer.application import application
from nearfar.viewer.beside import Beside
from nearfar.viewer.interactive import InteractiveTransport
from nearfar.viewer.payloads import ProjectorLink
from nearfar.viewer.photo_series import PhotoSeries

with needed(extra="viewer", what="a page in the browser"):
    from fastapi import FastAPI


def application_of_projectors(
    transports: Sequence[InteractiveTransport],
    beside: Beside | None,
    photo_maps: Mapping[str, Map],
    photo_series: PhotoSeries | None = None,
) -> FastAPI:
    """Return the application of some projectors: the first one's page, and below it the others'.

    Parameters
    ----------
    transports : sequence of InteractiveTransport
        Of the same camera, as `nearfar.applications.several_projectors` requires them.
    beside, photo_maps, photo_series
        Of the first one; see `nearfar.viewer.application.application`.
    """
    first, *others = transports
    page = application(first, beside, photo_maps, photo_series, _links(transports, 0))
    for number, transport in enumerate(others, 1):
        page.mount(
            f"/projector/{number}", application(transport, projectors=_links(transports, number))
        )
    return page


def _links(transports: Sequence[InteractiveTransport], here: int) -> list[ProjectorLink]:
    """Return the pages of all projectors, as seen from the page of one."""
    if len(transports) == 1:
        return []
    names = [transport.path.name for transport in transports]
    if len(set(names)) < len(names):
        names = [f"{number}: {name}" for number, name in enumerate(names, 1)]
    above = "../../" if here else "./"
    paths = [f"{above}projector/{number}/" if number else above for number in range(len(names))]
    paths[here] = ""
    return [ProjectorLink(*link) for link in zip(names, paths, strict=True)]
