"""Problems of lapswarm for pygmo: whole populations go to the evaluator at once, by ``batch_fitness``."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from . import _native

Array = npt.NDArray[np.float64]


class Problem:
    """A user-defined problem for ``pygmo.problem``; algorithms that take a batch evaluator (``pygmo.bfe``) use it whole.

    problem: one that lapswarm evaluates. backend and adapter: as for ``Evaluator``. penalty: what a candidate that failed
    costs in each objective.
    """

    def __init__(
        self,
        problem: _native.Problem,
        backend: str = "auto",
        adapter: str | None = None,
        penalty: float = 1e30,
    ) -> None:
        self.problem = problem
        self.evaluator = _native.Evaluator(problem, backend, adapter)
        self.penalty = penalty

    def get_bounds(self) -> tuple[Array, Array]:
        """Least and greatest values."""
        bounds = self.problem.bounds
        return bounds[:, 0], bounds[:, 1]

    def get_nobj(self) -> int:
        """Number of objectives."""
        return len(self.problem.objectives)

    def fitness(self, x: Array) -> Array:
        """The objectives of one candidate, of shape (m,)."""
        return self.batch_fitness(x)

    def batch_fitness(self, xs: Array) -> Array:
        """The objectives of candidates that follow one another, as pygmo has them: of shape (n * m,)."""
        rows = np.asarray(xs, dtype=float).reshape(-1, len(self.problem.names))
        found = self.evaluator.evaluate(rows).F
        return np.where(np.isfinite(found), found, self.penalty).ravel()

    def __deepcopy__(self, memo: object) -> Problem:
        # pygmo copies what it is given; an evaluator serves all copies.
        return self
