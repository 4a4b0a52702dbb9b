"""Which set-up corners best and rolls least at 50 m/s? A front over three parameters of the car and the steering angle."""

import lapswarm


def main() -> None:
    cars = lapswarm.SteadyProblem(
        "gt",
        free={
            "front_roll_moment_share": (0.4, 0.7),
            "aero_balance_front": (0.35, 0.55),
            "roll_stiffness_nm_per_rad": (5e4, 3e5),
        },
        speeds_mps=(49.0, 51.0),
        objectives=["minus_ay_mps2", "roll_rad"],
    )
    evaluator = lapswarm.Evaluator(cars)
    swarm = lapswarm.Optimiser(cars, population=48, iterations=30, archive=40)
    failed = 0
    while not swarm.done:
        found = evaluator.evaluate(swarm.ask())
        failed += sum(found.failure_counts.values())
        swarm.tell(found)
    candidates, costs = swarm.front
    print(f"{evaluator.backend}: {len(costs)} set-ups, {failed} of {swarm.evaluations} candidates failed")
    for row, (ay, roll) in sorted(zip(candidates.tolist(), costs.tolist(), strict=True), key=lambda r: r[1])[:5]:
        values = ", ".join(f"{name} {value:.4g}" for name, value in zip(cars.names, row, strict=True))
        print(f"{-ay:6.2f} m/s^2 at {roll:.4f} rad of roll: {values}")


if __name__ == "__main__":
    main()
