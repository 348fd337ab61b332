"""The part of the Aravis library (GigE Vision and USB3 Vision) that cameras need, by ctypes.

The library alone is enough, a package of every Linux: no bindings have to be built.
"""

import ctypes
import ctypes.util
import sys
from ctypes import (
    POINTER,
    byref,
    c_bool,
    c_char_p,
    c_double,
    c_int,
    c_int64,
    c_size_t,
    c_uint,
    c_uint64,
    c_void_p,
)
from functools import cache
from typing import Any

from nearfar.errors import DeviceError, MissingPackageError

NAMES = {
    "linux": ("libaravis-0.8.so.0", "libgobject-2.0.so.0", "libglib-2.0.so.0"),
    "darwin": ("libaravis-0.8.0.dylib", "libgobject-2.0.0.dylib", "libglib-2.0.0.dylib"),
    "win32": ("libaravis-0.8-0.dll", "libgobject-2.0-0.dll", "libglib-2.0-0.dll"),
}
INSTALL = (
    "install Aravis 0.8 (Debian and Ubuntu: apt install libaravis-0.8-0, macOS: brew install "
    "aravis)"
)

# Function: result, arguments; those that may fail take a GError** behind them.
PLAIN: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "arv_update_device_list": (None, ()),
    "arv_get_n_devices": (c_uint, ()),
    "arv_get_device_id": (c_char_p, (c_uint,)),
    "arv_get_device_vendor": (c_char_p, (c_uint,)),
    "arv_get_device_model": (c_char_p, (c_uint,)),
    "arv_stream_push_buffer": (None, (c_void_p, c_void_p)),
    "arv_stream_timeout_pop_buffer": (c_void_p, (c_void_p, c_uint64)),
    "arv_stream_try_pop_buffer": (c_void_p, (c_void_p,)),
    "arv_buffer_new_allocate": (c_void_p, (c_size_t,)),
    "arv_buffer_get_status": (c_int, (c_void_p,)),
    "arv_buffer_get_data": (c_void_p, (c_void_p, POINTER(c_size_t))),
    "arv_buffer_get_image_width": (c_int, (c_void_p,)),
    "arv_buffer_get_image_height": (c_int, (c_void_p,)),
    "arv_buffer_get_frame_id": (c_uint64, (c_void_p,)),
    "arv_camera_get_device": (c_void_p, (c_void_p,)),
    "arv_camera_is_gv_device": (c_bool, (c_void_p,)),
    "arv_gv_device_is_controller": (c_bool, (c_void_p,)),
}
FALLIBLE: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "arv_camera_new": (c_void_p, (c_char_p,)),
    "arv_camera_get_vendor_name": (c_char_p, (c_void_p,)),
    "arv_camera_get_model_name": (c_char_p, (c_void_p,)),
    "arv_camera_get_device_serial_number": (c_char_p, (c_void_p,)),
    "arv_camera_create_stream": (c_void_p, (c_void_p, c_void_p, c_void_p)),
    "arv_camera_start_acquisition": (None, (c_void_p,)),
    "arv_camera_stop_acquisition": (None, (c_void_p,)),
    "arv_camera_set_acquisition_mode": (None, (c_void_p, c_int)),
    "arv_camera_set_trigger": (None, (c_void_p, c_char_p)),
    "arv_camera_clear_triggers": (None, (c_void_p,)),
    "arv_camera_software_trigger": (None, (c_void_p,)),
    "arv_camera_get_payload": (c_uint, (c_void_p,)),
    "arv_camera_is_feature_available": (c_bool, (c_void_p, c_char_p)),
    "arv_camera_is_exposure_time_available": (c_bool, (c_void_p,)),
    "arv_camera_set_exposure_time": (None, (c_void_p, c_double)),
    "arv_camera_get_exposure_time": (c_double, (c_void_p,)),
    "arv_camera_get_exposure_time_bounds": (
        None,
        (c_void_p, POINTER(c_double), POINTER(c_double)),
    ),
    "arv_camera_set_pixel_format_from_string": (None, (c_void_p, c_char_p)),
    "arv_camera_get_pixel_format_as_string": (c_char_p, (c_void_p,)),
    "arv_camera_dup_available_pixel_formats_as_strings": (
        POINTER(c_char_p),
        (c_void_p, POINTER(c_uint)),
    ),
    "arv_camera_get_sensor_size": (None, (c_void_p, POINTER(c_int), POINTER(c_int))),
    "arv_camera_get_region": (None, (c_void_p, *(POINTER(c_int),) * 4)),
    "arv_camera_set_region": (None, (c_void_p, *(c_int,) * 4)),
    "arv_camera_set_string": (None, (c_void_p, c_char_p, c_char_p)),
    "arv_camera_set_integer": (None, (c_void_p, c_char_p, c_int64)),
    "arv_camera_set_float": (None, (c_void_p, c_char_p, c_double)),
    "arv_camera_set_boolean": (None, (c_void_p, c_char_p, c_bool)),
    "arv_camera_get_float": (c_double, (c_void_p, c_char_p)),
}


class _GError(ctypes.Structure):
    _fields_ = (("domain", c_uint), ("code", c_int), ("message", c_char_p))


class Aravis:
    """The loaded library; every error that it reports is raised as a `DeviceError`.

    Raises
    ------
    MissingPackageError
        If the library cannot be loaded.
    """

    def __init__(self) -> None:
        names = NAMES.get(sys.platform, NAMES["linux"])
        try:
            self._own, self._objects, self._glib = (_load(name) for name in names)
        except OSError as error:
            raise MissingPackageError(
                f"GigE Vision and USB3 Vision cameras need the library Aravis, which cannot be "
                f"loaded ({error}): {INSTALL}."
            ) from None
        for name, (result, arguments) in PLAIN.items():
            self._declare(name, result, arguments)
        for name, (result, arguments) in FALLIBLE.items():
            self._declare(name, result, (*arguments, POINTER(POINTER(_GError))))
        self._objects.g_object_unref.argtypes = (c_void_p,)
        self._glib.g_error_free.argtypes = (c_void_p,)
        self._glib.g_free.argtypes = (c_void_p,)

    def plain(self, name: str, *arguments: Any) -> Any:
        """Call a function that cannot fail."""
        return getattr(self._own, name)(*arguments)

    def call(self, name: str, *arguments: Any) -> Any:
        """Call a function that may fail.

        Raises
        ------
        DeviceError
            With the library's own words.
        """
        fault = POINTER(_GError)()
        result = getattr(self._own, name)(*arguments, byref(fault))
        if fault:
            words = (fault.contents.message or b"").decode(errors="replace")
            self._glib.g_error_free(fault)
            raise DeviceError(" ".join(words.split()).rstrip("."))
        return result

    def release(self, thing: Any) -> None:
        """Give a camera or a stream back."""
        self._objects.g_object_unref(thing)

    def pixel_formats(self, camera: Any) -> tuple[str, ...]:
        """List the pixel formats that a camera has now."""
        count = c_uint()
        name = "arv_camera_dup_available_pixel_formats_as_strings"
        listed = self.call(name, camera, byref(count))
        found = tuple(listed[i].decode() for i in range(count.value))
        self._glib.g_free(ctypes.cast(listed, c_void_p))
        return found

    def _declare(self, name: str, result: Any, arguments: tuple[Any, ...]) -> None:
        function = getattr(self._own, name)
        function.restype, function.argtypes = result, arguments


@cache
def aravis() -> Aravis:
    """Load the library once; raises as `Aravis`."""
    return Aravis()


def _load(name: str) -> ctypes.CDLL:
    try:
        return ctypes.CDLL(name)
    except OSError:
        # Where the loader does not look by itself, such as Homebrew's folders.
        stem = name.removeprefix("lib").split(".so", maxsplit=1)[0].removesuffix(".dylib")
        found = ctypes.util.find_library(stem)
        if found is None:
            raise
        return ctypes.CDLL(found)
