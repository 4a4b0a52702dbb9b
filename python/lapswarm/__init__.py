"""lapswarm evaluates whole swarms of race cars at once: which car drove this lap, and which line is the fastest it can drive.

Problems name bounded variables and objectives, evaluators score whole populations of them on the processor or a GPU, and
optimisers are asked for candidates and told what they are worth. Studies are what the command line runs.
"""

from . import figures
from ._frames import Car
from ._minimise import Minimum, minimise
from ._native import (
    MULTI_OBJECTIVE,
    SINGLE_OBJECTIVE,
    Evaluation,
    Evaluator,
    Optimiser,
    Problem,
    __version__,
)
from .errors import DeviceError, Error, FileError, InputError, Interrupted, MemoryLimitError, StudyError
from .problems import DriveProblem, EnergyProblem, LineProblem, OwnProblem, ReplayProblem, SteadyProblem
from .studies import (
    Result,
    Study,
    envelope,
    hybrid,
    identify,
    raceline,
    run,
    sensitivity,
    surface,
    transient,
)

__all__ = [
    "MULTI_OBJECTIVE",
    "SINGLE_OBJECTIVE",
    "Car",
    "DeviceError",
    "DriveProblem",
    "EnergyProblem",
    "Error",
    "Evaluation",
    "Evaluator",
    "FileError",
    "InputError",
    "Interrupted",
    "LineProblem",
    "MemoryLimitError",
    "Minimum",
    "Optimiser",
    "OwnProblem",
    "Problem",
    "ReplayProblem",
    "Result",
    "SteadyProblem",
    "Study",
    "StudyError",
    "__version__",
    "envelope",
    "figures",
    "hybrid",
    "identify",
    "minimise",
    "raceline",
    "run",
    "sensitivity",
    "surface",
    "transient",
]
