"""Files: pictures, Zarr stores, and outputs that appear whole or not at all."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from nearfar.files.arrays import read_arrays, write_array
from nearfar.files.codecs import encode_png
from nearfar.files.colour import from_srgb, luminance, to_srgb
from nearfar.files.images import (
    check_picture_ending,
    full_scale_of,
    full_scale_of_file,
    list_pictures,
    natural_key,
    read_light,
    read_linear,
    read_picture,
    require_finite,
    write_picture,
)
from nearfar.files.kinds import kind_of_store
from nearfar.files.output import check_output, new_output
from nearfar.files.resumable import UNFINISHED, check_resumable, resumable_output

if TYPE_CHECKING:
    from nearfar.files.stores import (
        add_array,
        add_to_store,
        create_durable_store,
        create_store,
        open_array,
        open_durable_store,
        open_store,
        read_array,
        read_selection,
    )

# Loaded when they are first asked for: much of a command's start is Zarr's, and plans and
# descriptions of rigs are files of other kinds.
_OF_STORES = {
    "add_array",
    "add_to_store",
    "create_durable_store",
    "create_store",
    "open_array",
    "open_durable_store",
    "open_store",
    "read_array",
    "read_selection",
}

__all__ = [
    "UNFINISHED",
    "add_array",
    "add_to_store",
    "check_output",
    "check_picture_ending",
    "check_resumable",
    "create_durable_store",
    "create_store",
    "encode_png",
    "from_srgb",
    "full_scale_of",
    "full_scale_of_file",
    "kind_of_store",
    "list_pictures",
    "luminance",
    "natural_key",
    "new_output",
    "open_array",
    "open_durable_store",
    "open_store",
    "read_array",
    "read_arrays",
    "read_light",
    "read_linear",
    "read_picture",
    "read_selection",
    "require_finite",
    "resumable_output",
    "to_srgb",
    "write_array",
    "write_picture",
]


def __getattr__(name: str) -> Any:
    if name not in _OF_STORES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("nearfar.files.stores"), name)
