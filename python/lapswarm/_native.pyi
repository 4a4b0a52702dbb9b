"""The native half of lapswarm."""

from collections.abc import Callable, Sequence
from typing import Any, TypedDict

import numpy as np
import numpy.typing as npt
from typing_extensions import Self

Array = npt.NDArray[np.float64]

__version__: str
SINGLE_OBJECTIVE: list[str]
MULTI_OBJECTIVE: list[str]
USUAL_MIB: int

class Setting(TypedDict):
    key: str
    unit: str
    range: str
    default: str | None
    meaning: str
    switch: bool

class StudyInfo(TypedDict):
    name: str
    about: str
    settings: list[Setting]

class Problem:
    def __new__(cls, other: Problem) -> Self: ...
    @staticmethod
    def of_study(kind: str, text: str, control_points: int | None = None) -> Problem: ...
    @staticmethod
    def of_steady(
        car: str,
        free: Sequence[tuple[str, float, float]],
        speeds_mps: Sequence[float],
        steers_rad: Sequence[float],
        objectives: Sequence[str],
    ) -> Problem: ...
    @staticmethod
    def of_own(
        variables: Sequence[tuple[str, str, float, float, bool]], objectives: Sequence[tuple[str, str]]
    ) -> Problem: ...
    @property
    def bounds(self) -> Array: ...
    @property
    def names(self) -> list[str]: ...
    @property
    def units(self) -> list[str]: ...
    @property
    def whole(self) -> list[bool]: ...
    @property
    def objectives(self) -> list[str]: ...
    @property
    def objective_units(self) -> list[str]: ...

class Evaluation:
    @property
    def F(self) -> Array: ...
    @property
    def failures(self) -> list[str | None]: ...
    @property
    def failure_counts(self) -> dict[str, int]: ...
    def __len__(self) -> int: ...

class Evaluator:
    def __new__(cls, problem: Problem, backend: str = "auto", adapter: str | None = None) -> Self: ...
    def evaluate(self, X: npt.ArrayLike, /) -> Evaluation: ...
    @property
    def problem(self) -> Problem: ...
    @property
    def backend(self) -> str: ...
    @property
    def device(self) -> str: ...
    @property
    def device_faults(self) -> list[str]: ...

class Optimiser:
    def __new__(
        cls,
        problem: Problem,
        name: str = "default",
        *,
        population: int = 100,
        iterations: int = 250,
        archive: int = 100,
        seed: int = 1,
    ) -> Self: ...
    def ask(self) -> Array: ...
    def tell(self, evaluation: Evaluation | npt.ArrayLike, violations: npt.ArrayLike | None = None) -> None: ...
    @property
    def done(self) -> bool: ...
    @property
    def iteration(self) -> int: ...
    @property
    def evaluations(self) -> int: ...
    @property
    def best(self) -> Array: ...
    @property
    def violation(self) -> float: ...
    @property
    def front(self) -> tuple[Array, Array]: ...
    def to_bytes(self) -> bytes: ...
    @staticmethod
    def from_bytes(state: bytes) -> Optimiser: ...

def optimiser_from_bytes(state: bytes) -> Optimiser: ...
def minimise(
    problem: Problem,
    function: Callable[[Array], npt.ArrayLike],
    asked: dict[str, Any],
    callback: Callable[[dict[str, Any]], object] | None,
) -> dict[str, Any]: ...
def studies() -> list[StudyInfo]: ...
def run_study(
    name: str,
    text: str,
    asked: dict[str, Any],
    callback: Callable[[dict[str, Any]], object] | None,
) -> dict[str, Any]: ...
def command_line(arguments: Sequence[str]) -> int: ...
