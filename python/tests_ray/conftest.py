"""A cluster of several nodes on this machine."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import ray
from ray.cluster_utils import Cluster

SMALL: dict[str, Any] = {
    "free": {"mass_kg": (1150.0, 1350.0)},
    "window_s": 1.5,
    "settle_s": 0.5,
    "population": 8,
    "iterations": 4,
    "hops": 0,
    "polish": False,
}


class Machines:
    """Nodes, which a test may add and kill."""

    def __init__(self) -> None:
        self.cluster = Cluster(
            initialize_head=True, head_node_args={"num_cpus": 2, "object_store_memory": 80 << 20, "include_dashboard": False}
        )
        ray.init(address=self.cluster.address, logging_level="error")
        self.added: list[Any] = []

    def add(self, **given: Any) -> Any:
        """One more node of a CPU."""
        node = self.cluster.add_node(**{"num_cpus": 1, "object_store_memory": 80 << 20} | given)
        self.cluster.wait_for_nodes()
        self.added.append(node)
        return node

    def kill(self, node_id: str) -> None:
        """Ends all processes of a node at once."""
        (node,) = [node for node in self.added if node.node_id == node_id]
        self.added.remove(node)
        self.cluster.remove_node(node, allow_graceful=False)

    def driver(self, script: str, *arguments: str) -> int:
        """Runs a driver of its own at the cluster, and tells what it ended with."""
        surroundings = os.environ | {"RAY_ADDRESS": self.cluster.address}
        return subprocess.run([sys.executable, "-c", script, *arguments], env=surroundings, check=False).returncode


@pytest.fixture(scope="session")
def all_machines() -> Iterator[Machines]:
    made = Machines()
    yield made
    ray.shutdown()
    made.cluster.shutdown()


@pytest.fixture
def machines(all_machines: Machines) -> Iterator[Machines]:
    yield all_machines
    for node in list(all_machines.added):
        all_machines.kill(node.node_id)


def once(path: Path) -> Callable[[], bool]:
    """Whether a call is the first one, on whatever machine."""
    where = str(path)

    def first() -> bool:
        try:
            os.close(os.open(where, os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            return False
        return True

    return first


def later(wanted: Callable[[], Any], act: Callable[[Any], object]) -> threading.Thread:
    """Acts, in a thread of its own, once something is there."""

    def work() -> None:
        until = time.monotonic() + 120
        while time.monotonic() < until:
            found = wanted()
            if found:
                act(found)
                return
            time.sleep(0.01)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    return thread
