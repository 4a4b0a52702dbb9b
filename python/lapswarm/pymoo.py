"""Problems of lapswarm for pymoo: whole populations go to the evaluator at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from pymoo.core.problem import Problem as _Base  # type: ignore[import-untyped]

from . import _native


class Problem(_Base):  # type: ignore[misc]
    """A problem of lapswarm as one of pymoo.

    problem: one that lapswarm evaluates. backend and adapter: as for ``Evaluator``. penalty: what a candidate that failed
    costs in each objective, for algorithms that cannot rank what is infinite.
    """

    def __init__(
        self,
        problem: _native.Problem,
        backend: str = "auto",
        adapter: str | None = None,
        penalty: float = 1e30,
    ) -> None:
        bounds = problem.bounds
        super().__init__(n_var=len(bounds), n_obj=len(problem.objectives), xl=bounds[:, 0], xu=bounds[:, 1])
        self.evaluator = _native.Evaluator(problem, backend, adapter)
        self.penalty = penalty

    def _evaluate(self, x: Any, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
        found = self.evaluator.evaluate(np.asarray(x, dtype=float)).F
        out["F"] = np.where(np.isfinite(found), found, self.penalty)
