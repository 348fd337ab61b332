"""Options of how a picture that is written for looking is to look."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

if TYPE_CHECKING:
    from nearfar.arrays import Floats

COLOURS = ("red", "green", "blue")

Exposure = Annotated[
    float, typer.Option(metavar="STOPS", help="Stops by which a .png is brighter, as in the page.")
]
Gamma = Annotated[
    float,
    typer.Option(
        min=0.1, max=10.0, help="Gamma of a .png on top of sRGB; above 1 it lifts the dark."
    ),
]
Channel = Annotated[
    str | None, typer.Option(metavar="COLOUR", help="Red, green or blue alone, in a grey .png.")
]


class Look(NamedTuple):
    """How a picture is to look; see `nearfar.files.developed`."""

    exposure: float
    gamma: float
    channel: int | None

    def of(self, picture: "Floats") -> "Floats":
        """Return a picture as it is to look."""
        from nearfar.files import developed

        return developed(picture, exposure=self.exposure, gamma=self.gamma, channel=self.channel)


def look_for(output: Path, exposure: float, gamma: float, channel: str | None) -> Look:
    """Return a look; refuse one for a file of numbers, which keep photo units."""
    if channel is not None and channel not in COLOURS:
        raise typer.BadParameter(
            f"{channel!r} is no colour: choose red, green or blue.", param_hint="--channel"
        )
    look = Look(exposure, gamma, None if channel is None else COLOURS.index(channel))
    if look != (0.0, 1.0, None) and output.suffix.lower() != ".png":
        raise typer.BadParameter(
            "--exposure, --gamma and --channel are for pictures to look at, and other files keep "
            "photo units: give a name that ends in .png."
        )
    return look
