"""The cluster: where it is, which versions it has, and which GPU Ray has given to a worker."""

from __future__ import annotations

import subprocess
import sys
import warnings
from typing import Any

import ray
from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

from .. import _native
from ..errors import DeviceError, InputError

# Nodes by their id, and whether lapswarm there is the one here.
_known: dict[str, str | None] = {}


def join() -> None:
    """Joins the cluster, or starts one on this machine if there is none."""
    if not ray.is_initialized():
        ray.init(include_dashboard=False, logging_level="warning")


def pinned(node: dict[str, Any]) -> Any:
    """The strategy that puts a worker on this node and on no other."""
    return NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)


def _probe() -> Any:
    # A function within a function travels whole: a node with another lapswarm, or with none, answers too.
    def version() -> str:
        try:
            from lapswarm import __version__
        except ImportError as error:
            return f"no lapswarm ({error})"
        return str(__version__)

    return ray.remote(version)


def nodes(strict: bool) -> list[dict[str, Any]]:
    """The living nodes whose lapswarm is of the same version as the one here.

    strict: whether another version is an error; otherwise a node that has it is told of, and does no work.
    """
    alive = [node for node in ray.nodes() if node["Alive"]]
    new = [node for node in alive if node["NodeID"] not in _known]
    probe = _probe()
    asked = [probe.options(num_cpus=0, scheduling_strategy=pinned(node)).remote() for node in new]
    for node, answer in zip(new, asked, strict=True):
        try:
            found = ray.get(answer)
        except ray.exceptions.RayError:
            # It has died meanwhile; if it lives, it is asked again.
            continue
        same = found == _native.__version__
        _known[node["NodeID"]] = None if same else found
        if not same:
            told = _other_version(node["NodeManagerHostname"], found, _native.__version__)
            if strict:
                del _known[node["NodeID"]]
                raise told
            warnings.warn(f"{told}; it does no work", stacklevel=3)
    return [node for node in alive if _known.get(node["NodeID"], "") is None]


def _other_version(name: str, found: str, expected: str) -> InputError:
    message = f"node {name}: version of lapswarm: found {found}, expected {expected}, as the driver has"
    return InputError(message, file=f"node {name}", field="version")


def check_version(expected: str) -> None:
    """Refuses to work, on this node, for a driver of another version: it may have come after the nodes were asked."""
    if expected != _native.__version__:
        raise _other_version(ray.util.get_node_ip_address(), _native.__version__, expected)


def get(reference: Any) -> Any:
    """What a task came to; an error of lapswarm or of the caller's own function is raised as itself."""
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        if isinstance(error.cause, Exception):
            raise error.cause from None
        raise


def adapter() -> str | None:
    """The GPU that Ray has given to this worker, by its PCI bus id as in ``0000:65:00.0``; None if it has given none."""
    given = [str(gpu) for gpu in ray.get_gpu_ids()]
    return bus_id(given[0]) if given else None


def bus_id(gpu: str) -> str:
    """The PCI bus id of a GPU of NVIDIA, of which Ray knows the index or the UUID."""
    query = ["nvidia-smi", "--query-gpu=pci.bus_id", "--format=csv,noheader", f"--id={gpu}"]
    try:
        said = subprocess.run(query, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        message = f"GPU {gpu}: its PCI bus id is not known, for nvidia-smi failed: {error}"
        raise DeviceError(message, field="adapter") from None
    # nvidia-smi tells the domain with eight digits.
    domain, rest = said.splitlines()[0].strip().lower().split(":", 1)
    return f"{domain[-4:]}:{rest}"


def tell(text: str) -> None:
    """Progress, on a line of its own that the next one replaces, if somebody looks."""
    if sys.stderr.isatty():
        sys.stderr.write(f"\r\x1b[2K{text}")
        sys.stderr.flush()


def told() -> None:
    """Ends the line of the progress."""
    if sys.stderr.isatty():
        sys.stderr.write("\n")
