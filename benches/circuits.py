"""Fastest lines of circuits: lap, gap, processor time and clearance, as tables in Markdown.

    cargo build --release
    cargo run --release --example circuits -- circuits
    python3 benches/circuits.py target/release/lapswarm circuits/*.csv

With `--every 1 2 4 8` the cross-sections are so many metres apart, one row for each circuit; else a row has the study with one
objective, the default three, and the gap to the best line of the first and of one with cross-sections every metre. With `--driven` the
fastest line of a car that is declared 3 m wide is driven by the 4DOF car.
"""

import argparse
import json
import pathlib
import resource
import subprocess
import tempfile


def spent_s():
    """Processor time of the programs that have ended (s)."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def lines(program, track, *flags):
    """The summary of a study, and the processor time that it took (s)."""
    with tempfile.TemporaryDirectory() as folder:
        before_s = spent_s()
        command = [program, "raceline", "--track", track, "--out", f"{folder}/run", "--quiet", *flags]
        subprocess.run(command, check=True, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        cpu_s = spent_s() - before_s
        summary = json.loads(pathlib.Path(folder, "run", "summary.json").read_text())
    return summary, cpu_s


def driven(program, track):
    """The row of a circuit that the 4DOF car drives: laps, what it loses, room to the edge, grip of its corners, processor time."""
    with tempfile.TemporaryDirectory() as folder:
        before_s = spent_s()
        line = ["raceline", "--track", track, "--objectives", "lap_time", "--car-width-m", "3", "--out", f"{folder}/line"]
        subprocess.run([program, *line, "--quiet"], check=True, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        drive = ["transient", "--line", f"{folder}/line/line_fastest.csv", "--out", f"{folder}/drive", "--quiet"]
        ended = subprocess.run([program, *drive], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        cpu_s = spent_s() - before_s
        file = pathlib.Path(folder, "drive", "summary.json")
        if not file.exists():
            return f"{' '.join(ended.stderr.split())} | | | | | | {cpu_s:.1f}"
        lap = json.loads(file.read_text())
    shares = [100 * corner["grip_share"] for corner in lap["corners"]] or [100 * lap["grip_share"]]
    return (
        f"{lap['full_grip_lap_time_s']:.3f} | {lap['lap_time_s']:.3f} | {lap['behind_full_grip_percent']:.2f} | "
        f"{lap['disagreement_percent']:.2f} | {lap['margin_m']:.3f} | {min(shares):.0f} to {max(shares):.0f} | {cpu_s:.1f}"
    )


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("program")
    arguments.add_argument("tracks", nargs="+")
    arguments.add_argument("--every", nargs="+", type=float, help="distances between cross-sections, m")
    arguments.add_argument("--driven", action="store_true", help="drive the fastest line of a car 3 m wide")
    given = arguments.parse_args()
    one = ["--objectives", "lap_time"]

    def at(track, length_m, metres):
        summary, cpu_s = lines(given.program, track, *one, "--sections", str(round(length_m / metres)))
        return summary["best"]["lap_time"]["lap_time_fine_s"], cpu_s

    if given.driven:
        print("| Circuit | All of the grip, s | Driven, s | Behind all of it, % | Behind the grip used, % | Room, m | Grip, % | Processor, s |")
        print("|---" * 8 + "|")
    elif given.every:
        print("| Circuit | " + " | ".join(f"{metres:g} m" for metres in given.every) + " |")
        print("|---" * (1 + len(given.every)) + "|")
    else:
        print("| Circuit | Length, m | Lap, s | Above the best known, % | Clearance, m | Processor, s | For three, s |")
        print("|---" * 7 + "|")
    for track in given.tracks:
        name = pathlib.Path(track).stem
        if given.driven:
            print(f"| {name} | {driven(given.program, track)} |", flush=True)
            continue
        summary, cpu_s = lines(given.program, track, *one)
        length_m, best = summary["reference"]["length_fine_m"], summary["best"]["lap_time"]
        if given.every:
            laps = [at(track, length_m, metres) for metres in given.every]
            cells = [f"{lap_s:.3f} ({taken_s:.1f})" for lap_s, taken_s in laps]
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
            continue
        _, three_s = lines(given.program, track)
        lap_s = best["lap_time_fine_s"]
        known_s = min(lap_s, at(track, length_m, 1.0)[0])
        print(
            f"| {name} | {length_m:.0f} | {lap_s:.3f} | {100 * (lap_s / known_s - 1):.3f} | {best['clearance_m']:.4f} | "
            f"{cpu_s:.1f} | {three_s:.1f} |",
            flush=True,
        )


main()
