"""One call to minimise a function of your own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _native
from .problems import OwnProblem

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Minimum:
    """What was found.

    X: candidates of shape (k, d); F: their objectives of shape (k, m). k is one for a single objective, and zero if every
    candidate failed. violation: by how much they violate the constraints. stopped: ``evaluations``, ``target``, ``time``,
    ``stagnation``, ``callback`` or ``interrupt``. history: a dict for each generation.
    """

    X: Array
    F: Array
    violation: float
    evaluations: int
    failures: dict[str, int]
    stopped: str
    history: list[dict[str, Any]]

    @property
    def x(self) -> Array:
        """The candidate of the least first objective, of shape (d,)."""
        best: Array = self.X[np.argmin(self.F[:, 0])]
        return best

    @property
    def f(self) -> float:
        """The least first objective."""
        return float(self.F[:, 0].min())


def minimise(
    bounds: Sequence[Sequence[float]] | _native.Problem,
    function: Callable[[Array], npt.ArrayLike],
    *,
    objectives: int = 1,
    inequalities: int = 0,
    equalities: int = 0,
    tolerance: float = 1e-4,
    algorithm: str = "default",
    seed: int = 1,
    population: int | None = None,
    evaluations: int | None = None,
    archive: int = 100,
    target: float | None = None,
    time_s: float | None = None,
    stagnation: tuple[int, float] | None = None,
    reference: Sequence[float] | None = None,
    callback: Callable[[dict[str, Any]], object] | None = None,
) -> Minimum:
    """Minimises a function that is given whole populations.

    bounds: of shape (d, 2), or a problem such as ``OwnProblem``, which then says how many objectives there are. function: is
    given an array of shape (n, d) and returns one of shape (n, m), for one objective of shape (n,) too; a candidate whose row
    is not finite has failed. Behind the objectives come the columns of ``inequalities``, wanted at zero or below, and of
    ``equalities``, wanted at zero within ``tolerance``. algorithm: one of ``SINGLE_OBJECTIVE`` or ``MULTI_OBJECTIVE``.
    evaluations: at the most; 100,000 for one objective and 25,000 for several. stagnation: evaluations that may gain no more
    than a share. reference: the point up to which the hypervolume is told. callback: is told of each generation, and stops the
    run when it returns something false that is not None. An interrupt stops the run too, with what was reached.

    >>> found = minimise([(-2, 3)] * 4, lambda X: (X**2).sum(axis=1), evaluations=8_000)
    >>> found.stopped, found.x.shape, found.f < 1e-6
    ('evaluations', (4,), True)
    """
    problem = bounds if isinstance(bounds, _native.Problem) else OwnProblem(bounds, objectives)
    asked = {
        "algorithm": algorithm,
        "seed": seed,
        "population": population,
        "evaluations": evaluations,
        "archive": archive,
        "inequalities": inequalities,
        "equalities": equalities,
        "tolerance": tolerance,
        "target": target,
        "time_s": time_s,
        "stagnation": stagnation,
        "reference": None if reference is None else [float(r) for r in reference],
    }
    return Minimum(**_native.minimise(problem, function, asked, callback))
