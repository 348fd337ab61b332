"""The calibration of a rig, kept in a folder beside its RIG.toml."""

import json
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from nearfar.arrays import Floats
from nearfar.errors import UnreadableFileError
from nearfar.photometry.exposures import Sensor
from nearfar.rigs.linear import LEVEL_COUNT, PRIMARY_COUNT

FORMAT_VERSION = 1
CALIBRATION_NAME = "calibration.json"


class Calibration(BaseModel):
    """A rig's radiometric calibration.

    Attributes
    ----------
    made : str
        When, ISO 8601; a capture remembers it.
    monitor, camera : str
        What was calibrated.
    exposure : float or None
        Seconds.
    response : tuple
        Light of each of 256 levels and 3 primaries over that of the highest.
    mixing : tuple
        What each primary at its highest adds in each camera channel, over what white adds in the
        brightest; (channels, 3).
    black, gain, read : float
        Camera: level = black + gain * electrons; read noise in levels.
    ambient : float
        Light under a black pattern, as a share of full scale: the room's, and what the projector
        leaks.
    linearity : float or None
        Largest error of a line through levels at several exposures, as a share of full scale.
    superposition : float
        Light of the primaries together over white's, less one.
    residual : float
        Largest error of the linearised ramp, as a share of white.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    format: Literal["nearfar calibration"] = "nearfar calibration"
    version: Literal[1] = 1
    made: str
    monitor: str
    camera: str
    exposure: float | None
    response: tuple[tuple[float, float, float], ...]
    mixing: tuple[tuple[float, float, float], ...]
    black: float
    gain: float = Field(gt=0)
    read: float = Field(ge=0)
    ambient: float
    linearity: float | None
    superposition: float
    residual: float

    @field_validator("response")
    @classmethod
    def _a_response(
        cls, table: tuple[tuple[float, float, float], ...]
    ) -> tuple[tuple[float, float, float], ...]:
        values = np.asarray(table)
        if values.shape != (LEVEL_COUNT, PRIMARY_COUNT) or (np.diff(values, axis=0) < 0).any():
            raise ValueError("the response has 256 levels of 3 primaries and never falls")
        return table

    @property
    def sensor(self) -> Sensor:
        """The camera's levels and their noise."""
        return Sensor(self.black, self.gain, self.read)

    def response_table(self) -> Floats:
        """Response as an array, (256, 3)."""
        return np.asarray(self.response)


def calibration_folder(rig: Path) -> Path:
    """Return where the calibration of a RIG.toml is kept: RIG.calibration beside it."""
    return rig.with_suffix(".calibration")


def read_calibration(folder: Path) -> Calibration | None:
    """Read a rig's calibration; None if it has none.

    Raises
    ------
    UnreadableFileError
        If it is damaged, or of another version.
    """
    path = folder / CALIBRATION_NAME
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        return Calibration.model_validate(data)
    except FileNotFoundError:
        return None
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the file"
        reason = f"{where}: {first['msg']}"
    except (OSError, ValueError, RecursionError) as error:
        reason = " ".join(str(error).split())
    raise UnreadableFileError(
        f"{path} is no calibration that can be read ({reason}): run nearfar calibrate again."
    )
