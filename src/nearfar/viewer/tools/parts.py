"""The picture of a light at rest, component by component, for a page that adds it to its own."""

from collections.abc import Iterator

from nearfar.viewer.interactive import InteractiveTransport, Relighting
from nearfar.viewer.messages import LightHeader, pack, unpack_levels
from nearfar.viewer.physical import PhysicalRelighting


def parts_of_picture(
    physical: PhysicalRelighting, transport: InteractiveTransport, message: bytes
) -> Iterator[bytes | None]:
    """Relight every camera pixel that is displayed, into the components of a split.

    Without a physical split, components are those of the model.

    Raises
    ------
    InputError
        If the message is wrong.
    """
    header, light = unpack_levels(LightHeader, message, transport.projector)
    is_physical = header.split == "physical" and physical.is_prepared
    relighting: Relighting = physical if is_physical else transport
    for frame in relighting.relight_exactly(light):
        if frame is None:
            yield None
        else:
            yield pack({"scale": frame.scale, "split": frame.split}, frame.parts)
