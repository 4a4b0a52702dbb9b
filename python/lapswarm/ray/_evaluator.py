"""One population spread over the cluster."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _native
from ..errors import InputError
from ._pool import Array, Found, Function, Handle, Job, Pool

# The part of a worker's share that it is given at once: what is left evens out what the rates did not tell.
_AT_ONCE = 0.75


@dataclass(frozen=True)
class Evaluation:
    """What a population is worth. F: shape (n, m), infinite where a candidate failed; failures: why, None where it did not."""

    F: Array
    failures: list[str | None]

    @property
    def failure_counts(self) -> dict[str, int]:
        """How many candidates failed, by the word."""
        failed = [why for why in self.failures if why is not None]
        return {why: failed.count(why) for why in sorted(set(failed))}

    def __len__(self) -> int:
        return len(self.failures)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        # So that an optimiser may be told of it.
        return np.array(self.F, dtype=dtype, copy=copy)

    def __repr__(self) -> str:
        failed = sum(self.failure_counts.values())
        return f"<evaluation of {len(self)} candidates, {failed} of which failed>"


class Evaluator:
    """Evaluates whole populations on all nodes of the cluster, with the figures of ``lapswarm.Evaluator`` on the same backend.

    problem: one of lapswarm's classes; the files that it reads go along. function: what evaluates a problem of one's own, given
    an array of shape (n, d). backend: ``cpu``, ``simd``, ``gpu``; ``auto`` is ``gpu`` where workers have GPUs, else ``simd``.
    num_cpus, num_gpus: what each worker takes; by default one worker has all CPUs of a node. least: candidates of the smallest
    portion. retries: how often a portion may be lost with its worker.

    Workers hold their CPUs and GPUs until ``close()`` or the end of a ``with`` block.
    """

    def __init__(
        self,
        problem: _native.Problem,
        backend: str = "auto",
        *,
        function: Function | None = None,
        num_cpus: float | None = None,
        num_gpus: float = 0,
        least: int = 16,
        retries: int = 3,
    ) -> None:
        if least < 1:
            raise InputError(f"least: found {least}, expected 1 or more", field="least")
        self.problem, self.least = problem, least
        self._pool = Pool(problem, function, backend, num_cpus, num_gpus, retries)
        self.backend = self._pool.backend

    @property
    def devices(self) -> list[tuple[str, str]]:
        """Node and device of each worker that has begun."""
        return [(h.node, h.device) for h in self._pool.handles.values() if h.device is not None]

    def evaluate(self, X: npt.ArrayLike, /) -> Evaluation:
        """The objectives of every candidate. X: shape (n, d), a row for each candidate in the units of the variables."""
        rows = checked(X, self.problem)
        F = np.empty((len(rows), len(self.problem.objectives)))
        failures: list[str | None] = [None] * len(rows)
        begun = 0

        def portion(handle: Handle) -> Job | None:
            nonlocal begun
            left = len(rows) - begun
            if left == 0:
                return None
            size = min(left, max(self.least, ceil(_AT_ONCE * left * self._pool.share(handle))))
            job = Job("evaluate", (rows[begun : begun + size],), begun, size)
            begun += size
            return job

        def done(job: Job, found: Found) -> None:
            F[job.place : job.place + job.size] = found[0]
            for k, why in found[1].items():
                failures[job.place + k] = why

        if len(rows):
            self._pool.run(portion, done)
        return Evaluation(F, failures)

    def close(self) -> None:
        """Ends the workers, and gives their CPUs and GPUs back."""
        self._pool.close()

    def __enter__(self) -> Evaluator:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<evaluator on {self.backend}, {len(self.devices)} workers>"


def checked(X: npt.ArrayLike, problem: _native.Problem) -> Array:
    """Candidates as rows of finite numbers, refused here before anything is sent."""
    names = problem.names
    try:
        rows = np.ascontiguousarray(X, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"X: type: found {error}, expected an array of numbers", file="X", field="type") from None
    if np.ndim(X) != 2:
        message = f"X: shape: found an array of shape {np.shape(X)}, expected two dimensions: a row for each candidate"
        raise InputError(message, file="X", field="shape")
    if rows.shape[1] != len(names):
        message = f"X: shape: found {rows.shape[1]} columns, expected {len(names)}, one for each variable"
        raise InputError(message, file="X", field="shape")
    wrong = np.argwhere(~np.isfinite(rows))
    if len(wrong):
        row, column = wrong[0]
        said = str(rows[row, column]).replace("nan", "NaN")
        message = f"X: {names[column]}: found {said} in row {row} (from 0), expected finite numbers"
        raise InputError(message, file="X", field=names[column])
    return rows
