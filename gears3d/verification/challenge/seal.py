"""How an answer is sealed: unreadable at a glance, and any later change of it seen by its hash."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import zlib
from typing import Any

from gears3d.errors import InputError

LONGEST = 1 << 24  # Bytes of an answer


def _stream(key: bytes, length: int) -> bytes:
    blocks = (hashlib.sha256(key + count.to_bytes(8, "big")).digest() for count in range(length // 32 + 1))
    return b"".join(blocks)[:length]


def close(answer: dict[str, Any]) -> str:
    """Return an answer as a line nobody reads by accident; whoever wants to can open it.

    >>> open_(close({"seed": 3}))
    {'seed': 3}
    """
    key = os.urandom(32)
    plain = zlib.compress(json.dumps(answer).encode())
    mixed = bytes(a ^ b for a, b in zip(plain, _stream(key, len(plain)), strict=True))
    return base64.b64encode(key + mixed).decode() + "\n"


def open_(sealed: str) -> dict[str, Any]:
    """Return the answer in a sealed line."""
    try:
        raw = base64.b64decode(sealed.strip(), validate=True)
        key, mixed = raw[:32], raw[32:]
        packed = bytes(a ^ b for a, b in zip(mixed, _stream(key, len(mixed)), strict=True))
        return json.loads(zlib.decompressobj().decompress(packed, LONGEST))
    except (ValueError, RecursionError, zlib.error) as error:
        raise InputError("answer.sealed: is no sealed answer (make the challenge again)") from error
