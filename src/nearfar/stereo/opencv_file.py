"""STEREO.yml: a stereo calibration in the YAML of OpenCV's FileStorage.

Keys are those of OpenCV's sample ``stereo_calib``, where 1 is the camera and 2 the projector: M1
and M2 (camera matrices), D1 and D2 (distortion), R and T (from the camera's frame to the
projector's); and ``size1`` and ``size2``, each [width, height], as OpenCV writes a `cv::Size`.
"""

from pathlib import Path
from typing import Any

import numpy as np
import yaml

from nearfar.arrays import AnyPath, Floats, Size
from nearfar.errors import InputError, UnreadableFileError
from nearfar.files import new_output
from nearfar.files.tables import read_text
from nearfar.stereo.calibration import StereoCalibration
from nearfar.stereo.lens import Lens

# OpenCV's own first line, which is no YAML.
FIRST_LINE = "%YAML"
MATRIX = "!!opencv-matrix"
NEEDED = ("size1", "M1", "D1", "size2", "M2", "D2", "R", "T")
ERROR = "reprojection_error"
LARGEST_SIDE = 2**20
# Of values that are no numbers, and of lists nested too deep.
MALFORMED = (yaml.YAMLError, KeyError, TypeError, ValueError, OverflowError, RecursionError)
# A calibration is some thousand characters.
LONGEST = 2**20


class _Loader(yaml.SafeLoader):  # type: ignore[misc]
    """Reads YAML and OpenCV's matrices, and makes numbers, text, lists and arrays alone."""

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        """Read a node; refuse an alias, by which a short file could stand for a huge matrix.

        Raises
        ------
        yaml.YAMLError
        """
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("it holds aliases, which OpenCV does not write")
        return super().compose_node(parent, index)


def _matrix(loader: _Loader, node: yaml.Node) -> Floats:
    """Return an ``!!opencv-matrix`` as an array."""
    if not isinstance(node, yaml.MappingNode):
        raise InputError("a matrix has no rows, cols and data")
    # YAML 1.1 takes 1e-05, which OpenCV writes, for text.
    found: dict[Any, Any] = loader.construct_mapping(node, deep=True)
    values = [float(value) for value in found["data"]]
    return np.array(values).reshape(int(found["rows"]), int(found["cols"]))


_Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", _matrix)


def read_stereo_calibration(path: AnyPath) -> StereoCalibration:
    """Read a stereo calibration from a STEREO.yml; nothing in it is executed.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    StereoCalibration

    Raises
    ------
    MissingFileError, UnreadableFileError
        If it is not there, or no YAML.
    InputError
        If a key is missing, or a matrix has another shape or is none of its kind.

    Examples
    --------
    >>> lines = [
    ...     "size1: [8, 8]",  # the camera: width, height
    ...     "M1: [[8, 0, 3.5], [0, 8, 3.5], [0, 0, 1]]",
    ...     "D1: [0, 0, 0, 0]",
    ...     "size2: [8, 8]",  # the projector
    ...     "M2: [[8, 0, 2.5], [0, 8, 3.5], [0, 0, 1]]",
    ...     "D2: [0, 0, 0, 0]",
    ...     "R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
    ...     "T: [0.25, 0, 0]",
    ... ]
    >>> with open("stereo.yml", "w") as file:
    ...     for line in lines:
    ...         print(line, file=file)
    >>> stereo = nearfar.read_stereo_calibration("stereo.yml")
    >>> stereo.translation
    array([0.25, 0.  , 0.  ])
    """
    path = Path(path)
    found = _parsed(path)
    missing = [key for key in NEEDED if key not in found]
    if missing:
        raise InputError(
            f"{path} has no {missing[0]}: it needs {', '.join(NEEDED)}, camera 1 being the camera "
            f"and 2 the projector; sizes are [width, height]."
        )
    camera, projector = (_size(found[key], key, path) for key in ("size1", "size2"))
    error = found.get(ERROR)
    return StereoCalibration.from_opencv(
        camera,
        found["M1"],
        found["D1"],
        projector,
        found["M2"],
        found["D2"],
        found["R"],
        found["T"],
        error if isinstance(error, float) and np.isfinite(error) else None,
        source=str(path),
    )


def save_stereo_calibration(
    stereo: StereoCalibration, path: AnyPath, *, force: bool = False
) -> None:
    """Write a stereo calibration, whole or not at all, as `read_stereo_calibration` reads it.

    OpenCV's FileStorage reads it, too.

    Parameters
    ----------
    stereo : StereoCalibration
    path : str or Path
    force : bool
        Replace a file that is there.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.

    Examples
    --------
    >>> matrix = np.array([[8, 0, 3.5], [0, 8, 3.5], [0, 0, 1]])
    >>> stereo = nearfar.StereoCalibration.from_opencv(
    ...     (8, 8), matrix, None, (8, 8), matrix, None, np.eye(3), [0.25, 0, 0]
    ... )
    >>> nearfar.save_stereo_calibration(stereo, "saved.yml")
    """
    lines = ["%YAML:1.0", "---", "# 1 is the camera, 2 the projector: X2 = R X1 + T"]
    for number, lens in enumerate((stereo.camera, stereo.projector), start=1):
        lines += _written(lens, number)
    lines += _matrix_lines("R", stereo.rotation)
    lines += _matrix_lines("T", stereo.translation[:, None])
    if stereo.error is not None:
        lines.append(f"{ERROR}: {_number(stereo.error)}")
    with new_output(Path(path), force=force) as partial:
        partial.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _parsed(path: Path) -> dict[str, Any]:
    text = read_text(path)
    if len(text) > LONGEST:
        raise UnreadableFileError(
            f"{path} is too long for a calibration: name the STEREO.yml of nearfar calibrate."
        )
    if text.startswith(FIRST_LINE):
        text = text.partition("\n")[2]
    try:
        # A loader that knows no objects.
        found = yaml.load(text, Loader=_Loader)
    except MALFORMED as error:
        reason = " ".join(str(error).split())[:200]
        raise UnreadableFileError(
            f"{path} is no calibration that can be read ({reason}): write it by nearfar "
            f"calibrate, or by OpenCV's FileStorage."
        ) from None
    if not isinstance(found, dict):
        raise UnreadableFileError(
            f"{path} holds no keys: write it by nearfar calibrate, or by OpenCV's FileStorage."
        )
    return found


def _size(value: Any, name: str, path: Path) -> Size:
    if (
        not isinstance(value, list)
        or len(value) != 2
        or not all(type(side) is int and 0 < side <= LARGEST_SIDE for side in value)
    ):
        raise InputError(
            f"{name} of {path} is no size: write [width, height] in pixels, such as [1920, 1080]."
        )
    return Size(value[1], value[0])


def _written(lens: Lens, number: int) -> list[str]:
    return [
        f"size{number}: [ {lens.size.width}, {lens.size.height} ]",
        *_matrix_lines(f"M{number}", lens.matrix),
        *_matrix_lines(f"D{number}", lens.distortion[None] if len(lens.distortion) else NO_LENS),
    ]


NO_LENS = np.zeros((1, 4))


def _matrix_lines(name: str, matrix: Floats) -> list[str]:
    rows, columns = matrix.shape
    data = ", ".join(_number(float(value)) for value in matrix.ravel())
    return [
        f"{name}: {MATRIX}",
        f"   rows: {rows}",
        f"   cols: {columns}",
        "   dt: d",
        f"   data: [ {data} ]",
    ]


def _number(value: float) -> str:
    """Write a number with all its digits, and a point, without which OpenCV takes it for whole."""
    text = repr(value)
    if "e" in text and "." not in text:
        mantissa, _, exponent = text.partition("e")
        return f"{mantissa}.0e{exponent}"
    return text
