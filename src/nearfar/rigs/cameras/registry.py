"""The camera drivers by name, and all cameras that they find."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BeforeValidator, SerializeAsAny

from nearfar.errors import ExtensionError, MissingPackageError
from nearfar.registry import Registry
from nearfar.rigs.cameras.driver import CameraDriver, CameraTable, FoundCamera

CAMERAS = Registry(
    "camera driver",
    "nearfar.cameras",
    {
        "aravis": "nearfar.rigs.cameras.aravis:DRIVER",
        "gphoto2": "nearfar.rigs.cameras.gphoto:DRIVER",
        "opencv": "nearfar.rigs.cameras.webcam:DRIVER",
        "harvesters": "nearfar.rigs.cameras.genicam:DRIVER",
        "folder": "nearfar.rigs.cameras.folder:DRIVER",
    },
    CameraDriver,
)


def _of_its_driver(table: Any) -> Any:
    """Read a [camera] table by the driver that it names."""
    if isinstance(table, Mapping) and isinstance(table.get("driver"), str):
        return CAMERAS[table["driver"]].table.model_validate(table)
    return table


AnyCameraTable = Annotated[SerializeAsAny[CameraTable], BeforeValidator(_of_its_driver)]


def find_cameras() -> tuple[list[FoundCamera], list[str]]:
    """List the cameras that all drivers find.

    Returns
    -------
    found : list of FoundCamera
    unable : list of str
        A sentence for each driver that cannot search: its package is missing, or it is another
        package's and fails.
    """
    found: list[FoundCamera] = []
    unable: list[str] = []
    for name in CAMERAS:
        try:
            found += _found_by(name)
        except (MissingPackageError, ExtensionError) as error:
            unable.append(str(error))
    return found, unable


def _found_by(name: str) -> list[FoundCamera]:
    find = CAMERAS[name].find
    if find is None:
        return []
    if name in CAMERAS.own:
        return list(find())
    try:
        found = [FoundCamera(*camera) for camera in find()]
    except MissingPackageError:
        raise
    except Exception as error:
        # Another package's driver may raise anything; the other drivers' cameras are listed all the
        # same.
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise ExtensionError(
            f"the camera driver {name!r} cannot search for cameras ({reason}): update or uninstall "
            f"its package."
        ) from error
    for camera in found:
        if camera.driver != name:
            raise ExtensionError(
                f"the camera driver {name!r} lists cameras of a driver {camera.driver!r}: update "
                f"or uninstall its package, which must list them under its own name."
            )
    return found
