"""Asking a viewer's server, as its page does."""

import json
import struct
import urllib.error
import urllib.request

import numpy as np
import pytest
from websockets.sync.client import connect

from nearfar.arrays import Size

PROJECTOR, CAMERA = Size(20, 24), Size(30, 42)
TYPES = {"float32": "<f4", "float16": "<f2", "uint16": "<u2"}


def unpack(data):
    (length,) = struct.unpack_from("<I", data)
    words = json.loads(data[4 : 4 + length])
    at, arrays = 4 + length, []
    assert at % 8 == 0
    for told in words["arrays"]:
        kind = np.dtype(TYPES[told["type"]])
        count = int(np.prod(told["shape"]))
        arrays.append(np.frombuffer(data, kind, count, at).reshape(told["shape"]))
        at += -(-count * kind.itemsize // 8) * 8
    return words, arrays


def message(light, **words):
    """Pack a light as the page does: levels of one channel or three."""
    levels = np.rint(65535 * light.reshape(*light.shape[:2], -1)).astype(np.uint16)
    text = json.dumps({"number": 1, "shape": levels.shape, **words}).encode()
    text += b" " * (-(4 + len(text)) % 8)
    return struct.pack("<I", len(text)) + text + levels.tobytes()


def ask(address, path, body=None, **headers):
    request = urllib.request.Request(address + path, data=body, headers=headers)
    with urllib.request.urlopen(request, timeout=30) as answer:
        return answer.read()


def refused(address, path, body=None, **headers):
    """Ask for what is refused; gives the status and what is said."""
    with pytest.raises(urllib.error.HTTPError) as error:
        ask(address, path, body, **headers)
    said = error.value.read().decode()
    error.value.close()
    return error.value.code, said


def socket_of(address, **options):
    return connect(address.replace("http", "ws") + "/relight", max_size=None, **options)


def picture(socket):
    """Receive the parts of a picture, in photo units."""
    told, (halves,) = unpack(socket.recv(timeout=30))
    return told, halves.astype(np.float32) / told["scale"]


def relit(address, light, **words):
    """Let the server relight until its picture is exact."""
    with socket_of(address) as socket:
        socket.send(message(light, **words))
        while True:
            told, parts = picture(socket)
            assert told["number"] == 1
            if told["exact"]:
                return told, parts
