"""Requests to a viewer's server, as its page sends them."""

import json
import struct
import urllib.error
import urllib.request

import numpy as np
import pytest
from websockets.sync.client import connect

from nearfar.arrays import Size
from tests.waiting import LONGEST_WAIT

PROJECTOR, CAMERA = Size(20, 24), Size(30, 42)
TYPES = {"float32": "<f4", "float16": "<f2", "uint16": "<u2", "uint8": "u1"}


def unpack(data):
    (length,) = struct.unpack_from("<I", data)
    header = json.loads(data[4 : 4 + length])
    at, arrays = 4 + length, []
    assert at % 8 == 0
    for array in header["arrays"]:
        dtype = np.dtype(TYPES[array["type"]])
        count = int(np.prod(array["shape"]))
        arrays.append(np.frombuffer(data, dtype, count, at).reshape(array["shape"]))
        at += -(-count * dtype.itemsize // 8) * 8
    return header, arrays


def message(light, **header):
    """Pack a light as the page does: levels of one channel or three."""
    levels = np.rint(65535 * light.reshape(*light.shape[:2], -1)).astype(np.uint16)
    text = json.dumps({"number": 1, "shape": levels.shape, **header}).encode()
    text += b" " * (-(4 + len(text)) % 8)
    return struct.pack("<I", len(text)) + text + levels.tobytes()


def ask(address, path, body=None, **headers):
    request = urllib.request.Request(address + path, data=body, headers=headers)
    with urllib.request.urlopen(request, timeout=LONGEST_WAIT) as response:
        return response.read()


def refused(address, path, body=None, **headers):
    """Send a request that is refused; return the status and the body."""
    with pytest.raises(urllib.error.HTTPError) as error:
        ask(address, path, body, **headers)
    text = error.value.read().decode()
    error.value.close()
    return error.value.code, text


def socket_of(address, **options):
    return connect(address.replace("http", "ws") + "/relight", max_size=None, **options)


def frame(socket):
    """Receive a frame; return its header and its parts in photo units."""
    header, (halves,) = unpack(socket.recv(timeout=LONGEST_WAIT))
    return header, halves.astype(np.float32) / header["scale"]


def relit(address, light, **header):
    """Let the server relight until its picture is exact."""
    with socket_of(address) as socket:
        socket.send(message(light, **header))
        while True:
            got, parts = frame(socket)
            assert got["number"] == 1
            if got["exact"]:
                return got, parts
