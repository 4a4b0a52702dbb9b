"""Islands: swarms that work apart and exchange solutions between epochs."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from .. import _native
from ..errors import InputError
from . import _cluster
from ._pool import Array, Function, Handle, Job, Pool
from ._store import Store, sealed, unsealed

# From whom each of n islands takes solutions.
TOPOLOGIES: dict[str, Callable[[int, int], list[int]]] = {
    "ring": lambda i, n: [(i - 1) % n],
    "both": lambda i, n: sorted({(i - 1) % n, (i + 1) % n}),
    "star": lambda i, n: list(range(1, n)) if i == 0 else [0],
    "all": lambda i, n: [k for k in range(n) if k != i],
    "none": lambda i, n: [],
}


@dataclass(frozen=True)
class Archipelago:
    """What islands came to.

    X, F: the solutions of all islands, none of which another dominates: shapes (k, d) and (k, m); one row for one objective.
    optimisers: the islands. evaluations and failed: candidates, and those of them that failed. epochs: those that are done.
    """

    X: Array
    F: Array
    optimisers: list[_native.Optimiser]
    evaluations: int
    failed: int
    epochs: int

    def __repr__(self) -> str:
        count, done = len(self.optimisers), self.epochs
        return f"<{count} islands after {done} epochs and {self.evaluations} evaluations: {len(self.F)} solutions>"


def islands(
    problem: _native.Problem,
    *,
    islands: int = 4,
    epochs: int = 10,
    iterations: int = 20,
    topology: str = "ring",
    migrants: int = 2,
    algorithm: str | None = None,
    population: int = 100,
    archive: int = 100,
    seed: int = 1,
    function: Function | None = None,
    backend: str = "auto",
    num_cpus: float = 1,
    num_gpus: float = 0,
    retries: int = 3,
    out: str | PathLike[str] | None = None,
    resume: bool = False,
    callback: Callable[[dict[str, Any]], object] | None = None,
) -> Archipelago:
    """Optimises on islands all over the cluster.

    Each island is a swarm of its own seed. After an epoch of so many iterations it takes in up to ``migrants`` solutions from
    the result of each neighbour: ``ring`` (the one before), ``both`` (before and behind), ``star`` (the first with all others),
    ``all``, ``none``. The result depends on the settings alone: not on how many workers there are, nor on which were lost.

    problem, function, backend, num_cpus, num_gpus, retries: as for ``Evaluator``; a worker takes one CPU by default and serves
    one island after the other. algorithm: a particle swarm or ``difference``; by default ``pso`` for one objective, ``default``
    for several. out: a folder, or a URL of fsspec, for the states after every epoch; ``resume`` continues from the last of them,
    or begins if there is none. callback: is told ``epoch``, ``epochs``, ``best``, ``evaluations``, and stops the run when it
    returns something false that is not None.
    """
    asked = {
        "islands": islands,
        "epochs": epochs,
        "iterations": iterations,
        "population": population,
        "archive": archive,
        "migrants": migrants,
    }
    for name, value in asked.items():
        if not isinstance(value, int) or value < 1:
            raise InputError(f"{name}: found {value}, expected a whole number, 1 or more", field=name)
    if topology not in TOPOLOGIES:
        message = f"topology: found {topology}, expected {', '.join(TOPOLOGIES)}"
        raise InputError(message, field="topology")
    if algorithm is None:
        algorithm = "pso" if len(problem.objectives) == 1 else "default"
    optimisers = [
        _native.Optimiser(
            problem,
            algorithm,
            population=population,
            iterations=epochs * iterations,
            archive=archive,
            seed=_seed(seed, island),
        )
        for island in range(islands)
    ]
    try:
        optimisers[0].accept(np.empty((0, len(problem.names))), np.empty((0, len(problem.objectives))))
    except InputError:
        message = f"algorithm: found {algorithm}, which takes in no solutions of other islands, expected a particle swarm or difference"
        raise InputError(message, field="algorithm") from None
    states = [optimiser.to_bytes() for optimiser in optimisers]
    store = None if out is None else Store(out)
    pool = Pool(problem, function, backend, num_cpus, num_gpus, retries, most=islands)
    try:
        head = asked | {
            "topology": topology,
            "algorithm": algorithm,
            "seed": seed,
            "backend": pool.backend,
            "version": _native.__version__,
            "problem": _sum_of(problem, pool),
        }
        epoch = failed = 0
        if store is not None:
            epoch, failed, states = _last(store, head, resume, states)
        while epoch < epochs:
            states, missed = _epoch(pool, states, epoch, head)
            epoch, failed = epoch + 1, failed + missed
            if store is not None:
                store.write(_name(epoch), sealed(head | {"epoch": epoch, "failed": failed}, states))
                # The one before stays, should this one be damaged.
                for old in [name for name in store.names() if _is_state(name) and name < _name(epoch - 1)]:
                    store.remove(old)
            optimisers = [_native.Optimiser.from_bytes(state) for state in states]
            best = np.min([optimiser.best for optimiser in optimisers], axis=0)
            evaluations = sum(optimiser.evaluations for optimiser in optimisers)
            _cluster.tell(f"epoch {epoch} of {epochs}: {evaluations} evaluations, best {', '.join(f'{f:.6g}' for f in best)}")
            if callback is not None:
                said = callback({"epoch": epoch, "epochs": epochs, "best": best, "evaluations": evaluations})
                if said is not None and not said:
                    break
        _cluster.told()
    finally:
        pool.close()
    optimisers = [_native.Optimiser.from_bytes(state) for state in states]
    fronts = [optimiser.front for optimiser in optimisers]
    X, F = np.vstack([x for x, _ in fronts]), np.vstack([f for _, f in fronts])
    kept = non_dominated(F)
    return Archipelago(X[kept], F[kept], optimisers, sum(o.evaluations for o in optimisers), failed, epoch)


def _epoch(pool: Pool, states: list[bytes], epoch: int, head: dict[str, Any]) -> tuple[list[bytes], int]:
    """All islands an epoch later, and how many candidates failed."""
    count = len(states)
    after, failed = [b""] * count, 0
    begun = 0

    def island(_: Handle) -> Job | None:
        nonlocal begun
        if begun == count:
            return None
        place, begun = begun, begun + 1
        sources = TOPOLOGIES[head["topology"]](place, count) if epoch > 0 and count > 1 else []
        neighbours = [states[source] for source in sources]
        return Job("epoch", (states[place], neighbours, head["migrants"], head["iterations"]), place)

    def done(job: Job, found: tuple[bytes, int]) -> None:
        nonlocal failed
        after[job.place] = found[0]
        failed += found[1]

    pool.run(island, done)
    return after, failed


def _seed(seed: int, island: int) -> int:
    """A seed of its own for each island, whatever the seeds of other runs."""
    return int(np.random.SeedSequence([seed, island]).generate_state(1, np.uint64)[0])


def _sum_of(problem: _native.Problem, pool: Pool) -> str:
    """A sum over what a problem is made of, and over the files that it reads."""
    recipe = pool.recipe
    told = (recipe.kind.__name__, recipe.given, recipe.settings, problem.names, problem.objectives, problem.bounds.tolist())
    added = hashlib.sha256(repr(told).encode())
    for name, content in sorted(recipe.files.items()):
        added.update(f"{name} {len(content)} ".encode() + content)
    return added.hexdigest()


def _name(epoch: int) -> str:
    return f"epoch-{epoch:06}.islands"


def _is_state(name: str) -> bool:
    return name.startswith("epoch-") and name.endswith(".islands")


def _last(store: Store, head: dict[str, Any], resume: bool, states: list[bytes]) -> tuple[int, int, list[bytes]]:
    """The last epoch that a store has whole, the candidates that failed until then, and the states."""
    names = [name for name in store.names() if _is_state(name)]
    if names and not resume:
        message = f"{store.place}: found islands of an earlier run, expected an empty folder, or resume=True"
        raise InputError(message, file=store.place, field="out")
    for name in reversed(names):
        found = unsealed(store.read(name))
        if found is None:
            continue
        kept, after = found
        for key, value in head.items():
            if kept.get(key) != value:
                message = f"{store.place}: {key}: found {kept.get(key)} in the run that is resumed, expected {value}"
                raise InputError(message, file=store.place, field=key)
        return kept["epoch"], kept["failed"], after
    if names:
        message = f"{store.place}: found damaged states, expected one that is whole"
        raise InputError(message, file=store.place, field="out")
    return 0, 0, states


def non_dominated(F: Array) -> list[int]:
    """The places of rows that no other dominates, in their order; of equal rows the first."""
    if F.shape[1] == 1:
        return [int(np.argmin(F[:, 0]))] if len(F) else []
    # In this order no row is dominated by a later one.
    kept: list[int] = []
    front = np.empty_like(F)
    for place in np.lexsort(F.T[::-1]):
        if not (front[: len(kept)] <= F[place]).all(axis=1).any():
            front[len(kept)] = F[place]
            kept.append(int(place))
    return sorted(kept)
