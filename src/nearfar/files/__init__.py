"""Files: pictures, and outputs that appear whole or not at all.

Stores are in `nearfar.files.stores`: Zarr is much of a command's start, and plans need none.
"""

from nearfar.files.arrays import read_arrays, write_array
from nearfar.files.codecs import encode_png
from nearfar.files.colour import developed, from_srgb, luminance, to_srgb
from nearfar.files.images import (
    check_picture_ending,
    full_scale_of,
    full_scale_of_file,
    light_of_size,
    list_pictures,
    natural_key,
    read_light,
    read_light_of_any_size,
    read_linear,
    read_picture,
    require_finite,
    write_light,
    write_picture,
)
from nearfar.files.kinds import kind_of_store
from nearfar.files.output import check_output, new_output
from nearfar.files.resumable import (
    UNFINISHED,
    ResumableKind,
    check_resumable,
    resumable_output,
)

__all__ = [
    "UNFINISHED",
    "ResumableKind",
    "check_output",
    "check_picture_ending",
    "check_resumable",
    "developed",
    "encode_png",
    "from_srgb",
    "full_scale_of",
    "full_scale_of_file",
    "kind_of_store",
    "light_of_size",
    "list_pictures",
    "luminance",
    "natural_key",
    "new_output",
    "read_arrays",
    "read_light",
    "read_light_of_any_size",
    "read_linear",
    "read_picture",
    "require_finite",
    "resumable_output",
    "to_srgb",
    "write_array",
    "write_light",
    "write_picture",
]
