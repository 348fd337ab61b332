"""Photos that were taken elsewhere: pair them with the patterns of a plan."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from nearfar.capture.shown import ShownPictures, require_photos
from nearfar.capture.store import Capture
from nearfar.capture.writing import write_capture
from nearfar.errors import InputError, MissingFileError, UnreadableFileError
from nearfar.files import full_scale_of_file, list_pictures, read_picture
from nearfar.files.images import PICTURE_KINDS
from nearfar.plan import Plan
from nearfar.progress import Report, ignore_progress


@dataclass(frozen=True)
class Pairing:
    """A photo and the pattern that it shows."""

    index: int
    pattern: str
    path: Path

    def __str__(self) -> str:
        """Return the pairing in a line."""
        return f"pattern {self.index} ({self.pattern}) <- {self.path.name}"


@dataclass(frozen=True)
class ImportSummary:
    """An imported capture, and its first and last pairing of pattern and photo to look over."""

    capture: Capture
    first: Pairing
    last: Pairing


def pair(
    plan: Plan, folder: Path, list_file: Path | None = None, *, source: str = "the plan"
) -> list[Path]:
    """Find the photo of each pattern: all pictures of a folder in natural order, or a list.

    Parameters
    ----------
    plan : Plan
    folder : Path
        Folder of the photos; img9 comes before img10.
    list_file : Path, optional
        Text file that names the photos instead, one per line relative to `folder`, in the order
        of the plan. Blank lines and lines that begin with # are skipped.
    source : str
        What the patterns are from, for the message.

    Returns
    -------
    list of Path
        A photo for each pattern.

    Raises
    ------
    MissingFileError
        If the folder, the list or a listed photo is not there.
    UnreadableFileError
        If the folder or the list cannot be read.
    InputError
        If the number of photos is not that of the patterns.
    """
    plan.require_real("import")
    photos = list_pictures(folder) if list_file is None else _listed(folder, list_file)
    count = len(plan.patterns)
    if len(photos) != count:
        taken = folder if list_file is None else list_file
        ends = f" (first {photos[0].name}, last {photos[-1].name})" if photos else ""
        plural = "s" * (len(photos) != 1)
        raise InputError(
            f"{taken} has {len(photos)} photo{plural}{ends}, but {source} has {count} patterns: "
            f"give one photo for each pattern"
            f"{_hint(folder, photos) if list_file is None else ''}."
        )
    return photos


def _hint(folder: Path, photos: Sequence[Path]) -> str:
    if (gap := _gap(photos)) is not None:
        return f" ({gap})"
    endings = Counter(p.suffix.lower() for p in folder.iterdir() if p not in photos and p.suffix)
    if photos or not endings:
        return ", or name them with `list_file`"
    (ending, number), *_ = endings.most_common(1)
    return f" as {PICTURE_KINDS} (the folder has {number} files that end in {ending})"


def _gap(photos: Sequence[Path]) -> str | None:
    """Say where the numbers in the names skip one, if they do so once."""
    numbers = [re.findall(r"\d+", photo.stem) for photo in photos]
    if not all(numbers):
        return None
    last = [int(each[-1]) for each in numbers]
    gaps = [i for i in range(1, len(last)) if last[i] - last[i - 1] != 1]
    if len(gaps) != 1 or last[gaps[0]] - last[gaps[0] - 1] < 2:
        return None
    before, after = (photos[gaps[0] - step].name for step in (1, 0))
    return f"the numbers skip from {before} to {after}, so that photos between them are missing"


def _listed(folder: Path, list_file: Path) -> list[Path]:
    try:
        lines = list_file.read_text(encoding="utf-8-sig").splitlines()
    except FileNotFoundError:
        raise MissingFileError(f"{list_file} is not there: check the name of the list.") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UnreadableFileError(
            f"{list_file} cannot be read as a list ({error}): give a text file with a photo's "
            f"name on each line."
        ) from error
    photos = []
    for number, line in enumerate(lines, start=1):
        name = line.strip()
        if name and not name.startswith("#"):
            photo = folder / name
            if not photo.is_file():
                raise MissingFileError(
                    f"{photo} is not there, which line {number} of {list_file} names: correct "
                    f"the line."
                )
            photos.append(photo)
    return photos


def pairing(plan: Plan, index: int, path: Path) -> Pairing:
    """Return which pattern a photo is taken to show, in words."""
    return Pairing(index, plan.patterns[index].description, path)


def import_photos(
    plan: Plan,
    photos: Sequence[Path],
    path: Path,
    *,
    full_scale: float | None = None,
    rig: Mapping[str, Any] | None = None,
    exposure: float | None = None,
    shown: ShownPictures | None = None,
    force: bool = False,
    progress: Report = ignore_progress,
) -> ImportSummary:
    """Import photos into a capture.

    Parameters
    ----------
    plan : Plan
    photos : sequence of Path
        A photo for each pattern, as `pair` gives them.
    path : Path
        Capture to make.
    full_scale, rig, exposure, force, progress
        As `nearfar.capture.write_capture`.
    shown : ShownPictures, optional
        The pictures that `plan` was made of.

    Returns
    -------
    ImportSummary

    Raises
    ------
    NearfarError
        As `nearfar.files.read_picture` and `nearfar.capture.write_capture`; a message names the
        photo, and nothing is left behind.
    """
    if shown is not None:
        require_photos(shown, photos)
    capture = write_capture(
        plan,
        path,
        _read(photos),
        full_scale=full_scale_of_file(photos[0]) if full_scale is None and photos else full_scale,
        rig={"description": "imported photos", **(rig or {})},
        exposure=exposure,
        names=[photo.name for photo in photos],
        shown=shown.read() if shown is not None and plan.offset == "shown" else None,
        force=force,
        progress=progress,
    )
    last = len(photos) - 1
    return ImportSummary(
        capture=capture,
        first=pairing(plan, 0, photos[0]),
        last=pairing(plan, last, photos[last]),
    )


def _read(photos: Sequence[Path]) -> Iterator[NDArray[Any]]:
    for photo in photos:
        yield read_picture(photo)
