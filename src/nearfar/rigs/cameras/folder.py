"""Any camera that drops its photos into a folder: by a cable, a wireless card, or a script."""

import os
import shlex
import subprocess
import time
from pathlib import Path
from typing import Any

from pydantic import field_validator

from nearfar.errors import DeviceError, InputError, LostPhotoError, UnreadableFileError
from nearfar.files.images import PICTURE_ENDINGS, RAW_ENDINGS
from nearfar.files.photos import decode_camera_file
from nearfar.rigs.cameras.base import Camera, Frame
from nearfar.rigs.cameras.driver import CameraDriver, CameraTable, PositiveLevel, Seconds

NAME = "folder"
SETTINGS = """\
# Run for each photo; {} is the folder. Without it, release the camera by hand.
# command = "gphoto2 --capture-image-and-download --filename {}/%n.%C"
# Seconds to wait for a photo.
# patience = 30.0
"""
ENDINGS = (*PICTURE_ENDINGS, *RAW_ENDINGS, ".jpg", ".jpeg")
# Seconds between listings of the folder; network folders do not notify of new files.
LISTING_INTERVAL_SECONDS = 0.05
# A file that has kept its size for this many listings is complete.
LISTINGS_OF_ONE_SIZE = 3


class FolderCamera(Camera):
    """A watched folder: each photo is the next file that appears in it.

    Parameters
    ----------
    path : Path
        The folder.
    command : str, optional
        Run for each photo, by the shell's rules of quoting but without a shell; ``{}`` in it is the
        folder. Without one the camera is released by hand or by a remote control.
    patience : float
        Seconds to wait for a photo.
    full_scale : float, optional
        Level at which a photo is saturated, where its file does not say so.
    frames : int
        As `Camera`.

    Raises
    ------
    DeviceError
        If there is no such folder.
    InputError
        If the command cannot be read.
    """

    def __init__(
        self,
        path: Path,
        *,
        command: str | None = None,
        patience: float = 30.0,
        full_scale: float | None = None,
        frames: int = 1,
    ) -> None:
        super().__init__(f"folder {path}", frames=frames)
        if not path.is_dir():
            raise DeviceError(f"{path} is no folder to watch: make it, or correct the rig.")
        try:
            self._command = [part.replace("{}", str(path)) for part in shlex.split(command or "")]
        except ValueError as error:
            raise InputError(
                f"the command {command!r} cannot be read ({error}): correct it."
            ) from None
        self._path, self._patience, self._full_scale = path, patience, full_scale
        self._used: set[str] = set()

    @property
    def full_scale(self) -> float:
        """Level at which a photo is saturated; found by the first photo."""
        if self._full_scale is None:
            self.take_surely()
        assert self._full_scale is not None
        return self._full_scale

    def describe(self) -> dict[str, Any]:
        """Return the settings that are recorded once in a capture, as JSON types."""
        return {**super().describe(), "driver": NAME, "command": self._command}

    def take(self) -> Frame:
        """Have a photo taken and wait for its file.

        Raises
        ------
        LostPhotoError
            If none comes, or one that cannot be read.
        DeviceError
            If the command fails.
        """
        before = self._files()
        if self._command:
            self._run()
        path = self._next(before)
        self._used.add(path.stem)
        try:
            photo = decode_camera_file(path.read_bytes(), path)
        except UnreadableFileError as error:
            raise LostPhotoError(str(error)) from None
        except OSError as error:
            raise LostPhotoError(
                f"{path} went away before it was read ({error.strerror}): leave photos where they "
                f"are."
            ) from None
        self._full_scale = self._full_scale or photo.full_scale
        self.linear = photo.linear
        return photo.levels

    def _run(self) -> None:
        try:
            done = subprocess.run(
                self._command, capture_output=True, timeout=self._patience, check=False
            )
        except OSError as error:
            raise DeviceError(
                f"the command {self._command[0]} cannot be run ({error.strerror}): correct it in "
                f"the rig."
            ) from None
        except subprocess.TimeoutExpired:
            raise LostPhotoError(
                f"the command {self._command[0]} did not end within {self._patience:g} s."
            ) from None
        if done.returncode:
            words = " ".join(done.stderr.decode(errors="replace").split())[:200].rstrip(".")
            raise LostPhotoError(
                f"the command {self._command[0]} failed with status {done.returncode} ({words})."
            )

    def _next(self, before: set[str]) -> Path:
        """Wait for a file that was not there, and until it is whole."""
        until = time.monotonic() + self._patience
        size, unchanged = -1, 0
        while time.monotonic() < until:
            new = sorted(self._files() - before)
            if len(new) > 1:
                raise DeviceError(
                    f"{len(new)} photos came into {self._path} for one pattern ({new[0]}, "
                    f"{new[1]}): let the camera write one file a photo, and nothing else there."
                )
            if new:
                path = self._path / new[0]
                if path.stem in self._used:
                    raise DeviceError(
                        f"{path} is a second file of a photo that was read already: let the camera "
                        f"write one file a photo, raw alone."
                    )
                now = _size(path)
                unchanged = unchanged + 1 if now == size and now > 0 else 0
                size = now
                if unchanged >= LISTINGS_OF_ONE_SIZE:
                    return path
            time.sleep(LISTING_INTERVAL_SECONDS)
        raise LostPhotoError(
            f"no photo came into {self._path} within {self._patience:g} s: check that the camera "
            f"writes there."
        )

    def _files(self) -> set[str]:
        try:
            with os.scandir(self._path) as entries:
                names = [entry.name for entry in entries]
        except OSError as error:
            raise DeviceError(
                f"{self._path} cannot be watched ({error.strerror}): connect it again."
            ) from None
        return {n for n in names if n.lower().endswith(ENDINGS) and not n.startswith(".")}


def _size(path: Path) -> int:
    """Bytes of a file; -1 if it has gone."""
    try:
        return path.stat().st_size
    except OSError:
        return -1


class FolderTable(CameraTable):
    """[camera] of a watched folder; the settings are those of `FolderCamera`."""

    path: str
    command: str | None = None
    patience: Seconds = 30.0
    full_scale: PositiveLevel | None = None

    @field_validator("bracket")
    @classmethod
    def _single(cls, bracket: tuple[float, ...]) -> tuple[float, ...]:
        if len(bracket) > 1:
            raise ValueError("whoever drops photos into a folder sets the exposure: remove it")
        return bracket

    def open(self, folder: Path) -> Camera:
        """Open the camera; raises as `CameraTable.open`."""
        return FolderCamera(
            folder / self.path,
            command=self.command,
            patience=self.patience,
            full_scale=self.full_scale,
            frames=self.average,
        )


DRIVER = CameraDriver(FolderTable, settings=SETTINGS)
