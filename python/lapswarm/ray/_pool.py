"""Workers all over the cluster, each with its own evaluator. What a lost one was at is done again by another."""

from __future__ import annotations

import os
import time
import warnings
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import ray

from .. import _native
from ..errors import DeviceError, InputError, StudyError
from . import _cluster
from ._inputs import Recipe
from ._migration import accepted

Array = npt.NDArray[np.float64]
Function = Callable[[Array], npt.ArrayLike]
# Objectives, and why candidates failed by their place.
Found = tuple[Array, dict[int, str]]

# Time between two looks at the nodes of the cluster (s).
LOOK_S = 1.0
# Time without any worker after which it is told (s).
PATIENCE_S = 30.0
# What Ray says of work whose process or node is gone.
LOST = (ray.exceptions.RayActorError, ray.exceptions.RaySystemError, ray.exceptions.WorkerCrashedError)


class Worker:
    """What a process of the cluster does: it evaluates, and takes islands from one epoch to the next."""

    def __init__(self, recipe: Recipe, function: Function | None, backend: str, threads: int) -> None:
        # Read when the first population is evaluated.
        os.environ["RAYON_NUM_THREADS"] = str(threads)
        self.recipe, self.function, self.backend = recipe, function, backend
        self.evaluator: _native.Evaluator | None = None
        self.width = 0

    def open(self) -> str:
        """Opens the evaluator, and says on which device."""
        _cluster.check_version(self.recipe.version)
        problem = self.recipe.make()
        self.width = len(problem.objectives)
        if self.function is not None:
            return "Python"
        self.evaluator = _native.Evaluator(problem, self.backend, _cluster.adapter())
        return self.evaluator.device

    def evaluate(self, X: Array) -> Found:
        """What candidates are worth."""
        if self.evaluator is not None:
            found = self.evaluator.evaluate(X)
            return found.F, {k: why for k, why in enumerate(found.failures) if why is not None}
        assert self.function is not None
        F = np.asarray(self.function(X), dtype=float)
        F = F[:, None] if self.width == 1 and F.ndim == 1 else F
        if F.shape != (len(X), self.width):
            message = f"the function's result: shape: found {F.shape}, expected {(len(X), self.width)}"
            raise InputError(message, file="the function's result", field="shape")
        failed = ~np.isfinite(F).all(axis=1)
        return np.where(failed[:, None], np.inf, F), {int(k): "undefined" for k in np.flatnonzero(failed)}

    def epoch(self, state: bytes, neighbours: list[bytes], migrants: int, iterations: int) -> tuple[bytes, int]:
        """An island's state an epoch later, and how many candidates failed in it."""
        for neighbour in neighbours:
            state = accepted(state, neighbour, migrants)
        optimiser = _native.Optimiser.from_bytes(state)
        failed = 0
        for _ in range(iterations):
            if optimiser.done:
                break
            F, failures = self.evaluate(optimiser.ask())
            optimiser.tell(F)
            failed += len(failures)
        return optimiser.to_bytes(), failed


@dataclass
class Job:
    """A call of a worker, how much work it is, and how often it was lost."""

    method: str
    arguments: tuple[Any, ...]
    place: int
    size: int = 1
    lost: int = 0


@dataclass
class Handle:
    """A worker: the actor, whether its evaluator is open, and its rate."""

    actor: Any
    node: str
    opening: Any
    device: str | None = None
    rate: float | None = None


class Pool:
    """The workers of one problem: on every node as many as it has the resources for, at most ``most``."""

    def __init__(
        self,
        problem: _native.Problem,
        function: Function | None,
        backend: str,
        num_cpus: float | None,
        num_gpus: float,
        retries: int,
        most: int | None = None,
    ) -> None:
        for name, value, least in (("num_cpus", num_cpus, 0.0), ("num_gpus", num_gpus, 0.0), ("retries", retries, 0)):
            if value is not None and not value >= least:
                raise InputError(f"{name}: found {value}, expected {least} or more", field=name)
        if backend not in ("auto", "cpu", "simd", "gpu"):
            raise InputError(f"backend: found {backend}, expected auto, cpu, simd, gpu", field="backend")
        if function is None and isinstance(problem, _native.Problem) and type(problem).__name__ == "OwnProblem":
            raise InputError("function: found none, expected what evaluates a problem of one's own", field="function")
        self.recipe = Recipe(problem)
        # One backend everywhere: a result must not depend on which node did the work.
        self.backend = ("gpu" if num_gpus else "simd") if backend == "auto" else backend
        self.num_cpus, self.num_gpus, self.retries, self.most = num_cpus, num_gpus, retries, most
        _cluster.join()
        self.shared = (ray.put(self.recipe), function if function is None else ray.put(function))
        self.handles: dict[tuple[str, int], Handle] = {}
        self.looked = 0.0
        self.lost_openings = 0
        self.refresh(strict=True)
        if not self.handles:
            asked = f"{self.num_cpus or 1:g} CPUs and {self.num_gpus:g} GPUs"
            raise DeviceError(f"the cluster: no node has {asked}, which a worker needs", file="the cluster")

    def _places(self, node: dict[str, Any]) -> tuple[int, float]:
        """How many workers a node has room for, and how many CPUs each of them takes."""
        cpus, gpus = node["Resources"].get("CPU", 0.0), node["Resources"].get("GPU", 0.0)
        by_gpu = int(gpus / self.num_gpus) if self.num_gpus else None
        if self.num_cpus is None:
            count = (1 if cpus else 0) if by_gpu is None else by_gpu
            return count, float(int(cpus / max(count, 1)))
        by_cpu = int(cpus / self.num_cpus) if self.num_cpus else 1
        return by_cpu if by_gpu is None else min(by_cpu, by_gpu), self.num_cpus

    def refresh(self, strict: bool = False) -> None:
        """Lets workers of dead nodes go, and sets workers up where there is room."""
        alive = _cluster.nodes(strict)
        self.looked = time.monotonic()
        ids = {node["NodeID"] for node in alive}
        for key in [key for key in self.handles if key[0] not in ids]:
            del self.handles[key]
        for node in alive:
            count, cpus = self._places(node)
            for place in range(count):
                key = (node["NodeID"], place)
                if key not in self.handles and (self.most is None or len(self.handles) < self.most):
                    self.handles[key] = self._start(node, cpus)

    def _start(self, node: dict[str, Any], cpus: float) -> Handle:
        kind = ray.remote(Worker).options(
            num_cpus=cpus, num_gpus=self.num_gpus, scheduling_strategy=_cluster.pinned(node), max_restarts=0
        )
        recipe, function = self.shared
        actor = kind.remote(recipe, function, self.backend, max(1, int(cpus)))
        return Handle(actor, node["NodeManagerHostname"], actor.open.remote())

    def _forget(self, handle: Handle) -> None:
        for key in [key for key, known in self.handles.items() if known is handle]:
            del self.handles[key]
        # One that is only out of reach must not answer any more.
        ray.kill(handle.actor)

    def share(self, handle: Handle) -> float:
        """The part of all work that is this worker's, by the measured rates."""
        known = [h.rate for h in self.handles.values() if h.rate is not None]
        usual = sum(known) / len(known) if known else 1.0
        rates = [h.rate or usual for h in self.handles.values() if h.device is not None]
        return (handle.rate or usual) / sum(rates)

    def run(self, next_job: Callable[[Handle], Job | None], done: Callable[[Job, Any], None]) -> None:
        """Does jobs until there are no more. ``next_job`` is asked for one for a worker that is idle, ``done`` is told results."""
        again: deque[Job] = deque()
        running: dict[Any, tuple[Handle, Job, float]] = {}
        patient_until = time.monotonic() + PATIENCE_S
        try:
            while True:
                busy = {id(handle) for handle, _, _ in running.values()}
                for handle in self.handles.values():
                    if handle.device is None or id(handle) in busy:
                        continue
                    job = again.popleft() if again else next_job(handle)
                    if job is None and not running:
                        return
                    if job is None:
                        break
                    call = getattr(handle.actor, job.method)
                    running[call.remote(*job.arguments)] = (handle, job, time.monotonic())
                opening = {h.opening: h for h in self.handles.values() if h.device is None}
                if running or opening:
                    ready = ray.wait([*running, *opening], num_returns=1, timeout=LOOK_S)[0]
                else:
                    time.sleep(LOOK_S / 10)
                    ready = []
                for reference in ready:
                    if reference in opening:
                        self._opened(opening[reference])
                        continue
                    handle, job, began = running.pop(reference)
                    try:
                        answer = _cluster.get(reference)
                    except LOST as error:
                        again.append(job)
                        job.lost += 1
                        self._lose(handle, job.lost, error)
                        continue
                    rate = job.size / max(time.monotonic() - began, 1e-6)
                    handle.rate = rate if handle.rate is None else 0.5 * (handle.rate + rate)
                    done(job, answer)
                if time.monotonic() - self.looked >= LOOK_S:
                    self.refresh()
                if running:
                    patient_until = time.monotonic() + PATIENCE_S
                elif time.monotonic() > patient_until:
                    warnings.warn("no worker has started: other work may hold the cluster's CPUs or GPUs", stacklevel=3)
                    patient_until = time.monotonic() + PATIENCE_S
        except BaseException:
            # What is still at work is of no use, and must not be in the way of what comes next.
            for handle, _, _ in running.values():
                self._forget(handle)
            raise

    def _opened(self, handle: Handle) -> None:
        try:
            handle.device = _cluster.get(handle.opening)
        except LOST as error:
            self.lost_openings += 1
            self._lose(handle, self.lost_openings, error)
            return
        self.lost_openings = 0

    def _lose(self, handle: Handle, times: int, error: Exception) -> None:
        self._forget(handle)
        if times > self.retries:
            raise StudyError(f"a worker on {handle.node} was lost {times} times at the same work: {error}") from None
        # Its place is free, or its node is gone.
        self.looked = 0.0

    def close(self) -> None:
        """Ends the workers, and gives their CPUs and GPUs back."""
        for handle in self.handles.values():
            ray.kill(handle.actor)
        self.handles.clear()
