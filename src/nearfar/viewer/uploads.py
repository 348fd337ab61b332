"""Bodies of requests, read within bounds of size and time."""

import asyncio

from nearfar.errors import InputError
from nearfar.packages import needed

with needed(extra="viewer", what="a page in the browser"):
    from fastapi import Request
    from starlette.requests import ClientDisconnect

UPLOAD_TIMEOUT_SECONDS = 60.0


async def read_body(request: Request, maximum_bytes: int) -> bytes:
    """Read the body of a request.

    Raises
    ------
    InputError
        If it is larger than `maximum_bytes`, takes longer than `UPLOAD_TIMEOUT_SECONDS`, or if
        the client disconnects.
    """
    parts, size = [], 0
    try:
        async with asyncio.timeout(UPLOAD_TIMEOUT_SECONDS):
            async for part in request.stream():
                size += len(part)
                if size > maximum_bytes:
                    raise InputError(
                        f"more than {maximum_bytes} bytes were sent: send a smaller file."
                    )
                parts.append(part)
    except TimeoutError:
        raise InputError(
            f"the file did not arrive within {UPLOAD_TIMEOUT_SECONDS:g} s: send it again."
        ) from None
    except ClientDisconnect:
        raise InputError("the page disconnected during an upload: send the file again.") from None
    return b"".join(parts)
