"""Migration between optimisers that are kept as bytes.

The library migrates within its own islands: several swarms that share a population. So the states of two swarms are put together
into the state of two islands, these migrate once, and the state of one is taken out again. What an island takes in is then what
it takes in when the library runs all islands in one process, to the bit.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np

from .. import _native
from ..errors import InputError

# Number of variables and of objectives, "LAPSWARM" and the version of the format, all of which stay as they are.
_HEAD = 28
_ISLANDS = {
    b"swarm": b"islands of swarms",
    b"difference swarm": b"islands of difference swarms",
    b"multi-objective swarm": b"islands of multi-objective swarms",
}


def _opened(state: bytes) -> tuple[bytes, bytes, bytes]:
    """Head, kind and payload of a state."""
    (length,) = struct.unpack_from("<I", state, _HEAD)
    at = _HEAD + 4 + length
    # Behind it are its length and, at the end, a sum over all.
    return state[:_HEAD], state[_HEAD + 4 : at], state[at + 8 : -4]


def _closed(head: bytes, kind: bytes, payload: bytes) -> bytes:
    body = head[16:] + struct.pack("<I", len(kind)) + kind + struct.pack("<Q", len(payload)) + payload
    return head[:16] + body + struct.pack("<I", zlib.crc32(body))


def _number(value: int) -> bytes:
    """A whole number as states have it: seven bits a byte, the lowest first."""
    written = bytearray()
    while value >= 128:
        written.append(value & 127 | 128)
        value >>= 7
    return bytes([*written, value])


def check_accepts(state: bytes, name: str) -> None:
    """Refuses optimisers that take in no solutions of others."""
    if _opened(state)[1] not in _ISLANDS:
        message = f"algorithm: found {name}, which takes in no solutions of other islands, expected a particle swarm or difference"
        raise InputError(message, field="algorithm")


def together(states: list[bytes], migrants: int) -> _native.Optimiser:
    """Islands of these states, of which each sends ``migrants`` solutions to the next after every iteration."""
    head, kind, _ = _opened(states[0])
    variables, objectives = struct.unpack_from("<QQ", head)
    swarms = _number(len(states)) + b"".join(_opened(state)[2] for state in states)
    migration = b"\x01" + _number(1) + _number(migrants)
    # They were asked for nothing yet, and are at the start.
    asked = _number(len(states)) + bytes(len(states))
    payload = swarms + migration + _number(variables) + _number(objectives) + asked + _number(0)
    return _native.Optimiser.from_bytes(_closed(head, _ISLANDS[kind], payload))


def accepted(state: bytes, neighbour: bytes, migrants: int) -> bytes:
    """The state of a swarm that has taken in up to ``migrants`` solutions from its neighbour's result."""
    both = together([state, neighbour], migrants)
    both.tell(np.empty((0, struct.unpack_from("<Q", state, 8)[0])))
    head, kind, _ = _opened(state)
    payload = _opened(both.to_bytes())[2][1:]
    # The first swarm is the shortest beginning that is a swarm: states tell no lengths, and archives grow.
    shortest, longest = 0, len(payload)
    while shortest < longest:
        middle = (shortest + longest) // 2
        if _is_whole(_closed(head, kind, payload[:middle])):
            longest = middle
        else:
            shortest = middle + 1
    return _closed(head, kind, payload[:shortest])


def _is_whole(state: bytes) -> bool:
    try:
        _native.Optimiser.from_bytes(state)
    except InputError:
        return False
    return True
