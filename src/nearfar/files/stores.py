"""Zarr groups (version 3) in which a missing or damaged chunk is an error, never zeros.

Metadata have a checksum, as chunks have; see `nearfar.files.checksums`.
"""

import contextlib
import json
import secrets
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.abc.store import ByteRequest, Store
from zarr.codecs import Crc32cCodec, ZstdCodec
from zarr.core.buffer import Buffer, BufferPrototype
from zarr.errors import ContainsArrayError, ContainsGroupError, NodeNotFoundError
from zarr.storage import LocalStore

from nearfar.errors import InputError, MissingFileError, NearfarError, UnreadableFileError
from nearfar.files.checksums import CHECKSUM, ChecksumError, with_checksum, without_checksum
from nearfar.files.kinds import METADATA
from nearfar.files.output import synchronise_entry
from nearfar.files.reading import forbidden_folders
from nearfar.files.writes import settle, wait_for_this_loop, write_into

# What zarr was seen to raise on metadata and chunks cut or changed at every byte.
_DAMAGE = (
    ValueError,
    TypeError,
    AttributeError,
    LookupError,
    RuntimeError,
    ArithmeticError,
    NodeNotFoundError,
)


# Bytes of a file that is read where it is asked for: zarr hands every file to a thread, which takes
# longer than reading a small one.
SMALL_FILE_BYTES = 2**16


def _read_if_small(path: Path, prototype: BufferPrototype) -> Buffer | None:
    try:
        if path.stat().st_size > SMALL_FILE_BYTES:
            return None
        return prototype.buffer.from_bytes(path.read_bytes())
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        return None


class _CheckedStore(LocalStore):
    """A folder store whose metadata must have the checksum with which they were written."""

    async def get(
        self,
        key: str,
        prototype: BufferPrototype | None = None,
        byte_range: ByteRequest | None = None,
    ) -> Buffer | None:
        """Read a file, metadata without their checksum."""
        wait_for_this_loop()
        value = None
        if prototype is not None and byte_range is None:
            value = _read_if_small(self.root / key, prototype)
        if value is None:
            value = await super().get(key, prototype, byte_range)
        if value is None or (self.root / key).name != METADATA:
            return value
        try:
            return type(value).from_bytes(without_checksum(value.to_bytes()))
        except ChecksumError:
            raise UnreadableFileError(
                f"{self.root} is damaged: its {key} is not as it was written, the checksum in it "
                f"says; copy or make it again, or, if you edited it by hand, undo that or remove "
                f"{CHECKSUM!r} from its attributes."
            ) from None


class _FolderStore(_CheckedStore):
    """A folder store for writing.

    A chunk makes no folder of its own: what zarr's threads still write after one of them has
    failed must not bring a removed folder back.
    """

    async def set(self, key: str, value: Buffer) -> None:
        """Write a file whole or not at all."""
        await write_into(self.root, partial(_write, self.root / key, value))

    async def set_if_not_exists(self, key: str, value: Buffer) -> None:
        """Write a file that is not there; zarr does so with a group's metadata for its arrays."""
        if not (self.root / key).exists():
            await self.set(key, value)


class _DurableStore(_FolderStore):
    """A folder store for writing, in which what is set is on the disk when the call returns."""

    async def set(self, key: str, value: Buffer) -> None:
        """Write a file whole or not at all, and wait for the disk."""
        await write_into(self.root, partial(_write_durably, self.root / key, value))


def _write(path: Path, value: Buffer) -> None:
    _written_beside(path, value).replace(path)


def _write_durably(path: Path, value: Buffer) -> None:
    beside = _written_beside(path, value)
    synchronise_entry(beside)
    beside.replace(path)
    synchronise_entry(path.parent)


def _written_beside(path: Path, value: Buffer) -> Path:
    if path.name == METADATA:
        path.parent.mkdir(parents=True, exist_ok=True)
    # Other processes may write the same file, and the same into it.
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}.partial")
    data = value.as_buffer_like()
    beside.write_bytes(with_checksum(bytes(data)) if path.name == METADATA else data)
    return beside


class _WholeStore(_CheckedStore):
    """A folder store for reading, in which every chunk must be there."""

    async def get(
        self,
        key: str,
        prototype: BufferPrototype | None = None,
        byte_range: ByteRequest | None = None,
    ) -> Buffer | None:
        """Read a file; only metadata may be missing."""
        path = self.root / key
        try:
            value = await super().get(key, prototype, byte_range)
        except NearfarError:
            raise
        except OSError as error:
            raise UnreadableFileError(
                f"{path} cannot be read ({error.strerror}): check the disk and its permissions."
            ) from error
        if value is None and path.name != METADATA:
            raise UnreadableFileError(
                f"{self.root} is damaged: {key} is missing; copy or make it again."
            )
        return value


def create_store(
    path: Path, kind: str, version: int, attributes: Mapping[str, Any] | None = None
) -> zarr.Group:
    """Make a Zarr group of ours; use it within `nearfar.files.output.new_output`.

    Parameters
    ----------
    path : Path
        Folder to make.
    kind : str
        What it holds, for instance ``"nearfar capture"``.
    version : int
        Version of the format.
    attributes : mapping, optional
        JSON values to keep with it.
    """
    return _create(_FolderStore(path), kind, version, attributes)


def create_durable_store(
    path: Path, kind: str, version: int, attributes: Mapping[str, Any] | None = None
) -> zarr.Group:
    """Make a Zarr group as `create_store`, whose chunks are on the disk once written."""
    return _create(_DurableStore(path), kind, version, attributes)


def open_durable_store(path: Path) -> zarr.Group:
    """Open a group that `create_durable_store` made, to go on writing."""
    return zarr.open_group(_DurableStore(path), mode="r+", zarr_format=3)


def add_to_store(
    path: Path, kind: str, version: int, attributes: Mapping[str, Any] | None = None
) -> zarr.Group:
    """Open a group that `create_store` made, to go on writing; make it where it is not there."""
    if not (path / METADATA).exists():
        # Another process that writes here may be quicker than this one.
        with contextlib.suppress(ContainsGroupError):
            return create_store(path, kind, version, attributes)
    return zarr.open_group(_FolderStore(path), mode="r+", zarr_format=3)


def _create(
    store: LocalStore, kind: str, version: int, attributes: Mapping[str, Any] | None
) -> zarr.Group:
    return zarr.create_group(
        store,
        zarr_format=3,
        attributes={"format": kind, "version": version, **(attributes or {})},
    )


def add_array(
    group: zarr.Group,
    name: str,
    shape: tuple[int, ...],
    dtype: np.dtype[Any] | type[np.generic] | str,
    chunks: tuple[int, ...],
) -> zarr.Array[Any]:
    """Add an array of checksummed chunks, all of which are written, zeros too.

    An array that was laid out in the same way is opened instead.
    """
    if not (_root(group.store) / name / METADATA).exists():
        # Another process that writes here may be quicker than this one.
        with contextlib.suppress(ContainsArrayError):
            return _new_array(group, name, shape, dtype, chunks)
    return _laid_out(group, name, shape, chunks)


def _laid_out(
    group: zarr.Group, name: str, shape: tuple[int, ...], chunks: tuple[int, ...]
) -> zarr.Array[Any]:
    """Return the array if it exists already, in the same layout."""
    found = group[name]
    if not isinstance(found, zarr.Array) or (found.shape, found.chunks) != (shape, chunks):
        raise ValueError(f"{name} is laid out otherwise in {_root(group.store)}")
    # Not kept on the disk: chunks of zeros would be left out.
    return found.with_config({"write_empty_chunks": True})


def _new_array(
    group: zarr.Group,
    name: str,
    shape: tuple[int, ...],
    dtype: np.dtype[Any] | type[np.generic] | str,
    chunks: tuple[int, ...],
) -> zarr.Array[Any]:
    return group.create_array(
        name,
        shape=shape,
        dtype=np.dtype(dtype),
        chunks=chunks,
        compressors=[ZstdCodec(level=1), Crc32cCodec()],
        # One flat folder per array: a new chunk is durable with one folder to wait for.
        chunk_key_encoding={"name": "default", "separator": "."},
        fill_value=0,
        config={"write_empty_chunks": True},
    )


def open_store(path: Path, kind: str, *versions: int) -> zarr.Group:
    """Open a Zarr group of ours for reading.

    Parameters
    ----------
    path : Path
    kind : str
        What it must hold.
    *versions : int
        The versions of the format that are read, rising.

    Raises
    ------
    MissingFileError
        If there is nothing.
    UnreadableFileError
        If it is no Zarr group, of another kind or version, or damaged.
    """
    article = "an" if kind[0] in "aeiou" else "a"
    with forbidden_folders(path):
        if not path.exists():
            raise MissingFileError(f"{path} is not there: check the name.")
        if not (path / METADATA).is_file():
            raise UnreadableFileError(
                f"{path} is not {article} {kind}: it is no Zarr folder with a zarr.json; check the "
                f"name."
            )
        with _sentences(path, "its zarr.json"):
            store = _WholeStore(path, read_only=True)
            group = zarr.open_group(store, mode="r", zarr_format=3, use_consolidated=False)
            found, found_version = group.attrs.get("format"), group.attrs.get("version")
    if found != kind:
        other = f"a {found}" if str(found).startswith("nearfar ") else "of another kind"
        raise UnreadableFileError(f"{path} is not {article} {kind} but {other}: check the name.")
    if found_version not in versions:
        read = f"versions {versions[0]} to" if len(versions) > 1 else "version"
        raise UnreadableFileError(
            f"{path} is {article} {kind} of version {found_version!r}, this nearfar reads {read} "
            f"{versions[-1]}: make it again, or use the nearfar that made it."
        )
    return group


def is_plain_array(path: Path) -> bool:
    """Return whether a folder is a single Zarr array, as other software writes it."""
    if (path / ".zarray").is_file():
        return True
    try:
        return bool(json.loads((path / METADATA).read_bytes())["node_type"] == "array")
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return False


def read_plain_array(path: Path) -> NDArray[Any]:
    """Read a single Zarr array; by Zarr's own rule a chunk that is missing holds the fill value.

    Raises
    ------
    UnreadableFileError
        If it is damaged.
    """
    with _sentences(path, "it"):
        return np.asarray(zarr.open_array(LocalStore(path, read_only=True), mode="r")[...])


def open_array(group: zarr.Group, name: str) -> zarr.Array[Any]:
    """Open an array of a group for reading.

    Raises
    ------
    UnreadableFileError
        If it is missing or its metadata damaged.
    """
    path = _root(group.store)
    with _sentences(path, f"array {name}"):
        array = group[name]
    if not isinstance(array, zarr.Array):
        raise UnreadableFileError(f"{path} is damaged: {name} is no array; make it again.")
    return array


def read_array(group: zarr.Group, name: str, selection: Any = ...) -> NDArray[Any]:
    """Read an array of a group, or a part of it.

    Parameters
    ----------
    group : zarr.Group
    name : str
    selection : slices, integers and lists of integers, a dimension each
        By default all.

    Raises
    ------
    UnreadableFileError
        If the array or a chunk is missing or damaged.
    InputError
        If the selection is not in the array.
    """
    return read_selection(open_array(group, name), selection)


def read_selection(array: zarr.Array[Any], selection: Any = ...) -> NDArray[Any]:
    """Read a part of an open array; raises as `read_array`."""
    path = _root(array.store)
    with _sentences(path, f"array {array.basename}"):
        try:
            return np.asarray(array.oindex[selection])
        except IndexError as error:
            raise InputError(f"{path} has no such part of {array.basename}: {error}.") from error


def _root(store: Store) -> Path:
    return store.root if isinstance(store, LocalStore) else Path(str(store))


@contextlib.contextmanager
def _sentences(path: Path, what: str) -> Iterator[None]:
    try:
        yield
    except NearfarError:
        settle()
        raise
    except _DAMAGE as error:
        settle()
        reason = (str(error).strip() or type(error).__name__).splitlines()[0].rstrip(".")[:120]
        raise UnreadableFileError(
            f"{path} is damaged: {what} cannot be read ({reason}); copy or make it again."
        ) from error
