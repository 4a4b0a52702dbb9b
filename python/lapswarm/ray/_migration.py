"""Migration between optimisers that are kept as bytes."""

from __future__ import annotations

import numpy as np

from .. import _native


def accepted(state: bytes, neighbour: bytes, migrants: int) -> bytes:
    """The state of a swarm that has taken in up to ``migrants`` solutions from its neighbour's result, evenly over it.

    They are those that the library sends between its own islands in one process, so the swarm goes on to the same bits.
    """
    swarm, other = _native.Optimiser.from_bytes(state), _native.Optimiser.from_bytes(neighbour)
    X, F = other.front
    sent = min(migrants, len(F))
    rows = [i * len(F) // sent for i in range(sent)]
    swarm.accept(X[rows], F[rows], np.full(sent, other.violation))
    return swarm.to_bytes()
