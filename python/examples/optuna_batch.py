"""Optuna asks and is told in batches: which set-up corners best at 50 m/s? Every batch is one population of the evaluator.

Needs optuna: ``pip install optuna``.
"""

import sys

import lapswarm
import numpy as np
import optuna

BATCH, BATCHES = 32, 6


def main() -> None:
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    cars = lapswarm.SteadyProblem(
        "gt",
        free={"front_roll_moment_share": (0.4, 0.7), "aero_balance_front": (0.35, 0.55)},
        speeds_mps=(49.0, 51.0),
    )
    evaluator = lapswarm.Evaluator(cars, "simd")
    space: dict[str, optuna.distributions.BaseDistribution] = {
        name: optuna.distributions.FloatDistribution(lower, upper)
        for name, (lower, upper) in zip(cars.names, cars.bounds.tolist(), strict=True)
    }
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1, constant_liar=True))
    firsts = []
    for _ in range(BATCHES):
        trials = [study.ask(space) for _ in range(BATCH)]
        found = evaluator.evaluate([[trial.params[name] for name in cars.names] for trial in trials])
        for trial, cost, failure in zip(trials, found.F[:, 0].tolist(), found.failures, strict=True):
            if failure is None:
                study.tell(trial, cost)
            else:
                study.tell(trial, state=optuna.trial.TrialState.FAIL)
        firsts.append(study.best_value)
    values = ", ".join(f"{name} {value:.4g}" for name, value in study.best_params.items())
    print(f"{-study.best_value:.2f} m/s^2 after {len(study.trials)} cars: {values}")
    again = evaluator.evaluate(np.array([[study.best_params[name] for name in cars.names]])).F[0, 0]
    if again != study.best_value or not firsts[-1] < firsts[0]:
        sys.exit("the best car is not what was told, or no batch was better than the first")


if __name__ == "__main__":
    main()
