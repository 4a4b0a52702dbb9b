#!/bin/sh
# Mixed small studies in a loop under a memory limit: soak.sh SECONDS [FOLDER], of two rounds at least. What comes of equal
# seeds must be equal to the byte, times aside; no study's peak of memory may grow from round to round; and a long sweep, many
# studies in one process, may not take more than a short one. Prints a line for each round and the figures at the end; ends with
# 1 if anything differed or grew. LAPSWARM names the program, else it is built. Reads /proc, so it needs Linux.
set -eu
seconds=${1:?how many seconds}
root=$(cd "$(dirname "$0")/.." && pwd)
if [ -z "${LAPSWARM:-}" ]; then
    cargo build --release --quiet --manifest-path "$root/Cargo.toml"
    LAPSWARM=$root/target/release/lapswarm
fi
folder=${2:-$(mktemp -d)}
mkdir -p "$folder"
cd "$folder"
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-/tmp}" NODEVICE_SELECT=1
limit=512

cat >identify.toml <<'STUDY'
section = "Abbey"
polish = false
[swarm]
population = 64
iterations = 60
STUDY
sweep() { # NAME RUNS
    seeds=$(seq -s , 1 "$2")
    cat >"$1.toml" <<STUDY
study = "identify"
[base]
section = "Abbey"
polish = false
backend = "simd"
[base.swarm]
population = 32
iterations = 20
[grid]
seed = [$seeds]
STUDY
}
sweep short 4
sweep long 60

# Runs a study into a folder; leaves its peak of memory (kB) in $peak.
run() { # FOLDER ARGUMENTS...
    out=$1
    shift
    rm -rf "$out"
    "$LAPSWARM" "$@" --out "$out" --quiet >"$out.log" 2>&1 &
    child=$!
    peak=0
    # The mark only rises, so that the last one seen is the highest.
    while kill -0 "$child" 2>/dev/null; do
        now=$(sed -n 's/^VmHWM:[^0-9]*\([0-9]*\).*/\1/p' "/proc/$child/status" 2>/dev/null || true)
        [ -z "$now" ] || peak=$now
        sleep 0.05
    done
    wait "$child" || {
        echo "$* failed:" >&2
        cat "$out.log" >&2
        exit 1
    }
}

# What a run has come to, without what tells the time.
sum() { # FOLDER
    find "$1" -type f ! -name manifest.json ! -name report.html ! -name '.*' | sort | while read -r file; do
        case $file in
            *.json) grep -vE '"[a-z_]*(elapsed_s|per_s|search_s|exact_s|solve_s|polish_s|dispatch_ms)"' "$file" | cksum ;;
            # What sweeps reached by what it cost goes by the clock too.
            */times.csv | run-sweep-*/convergence.svg) echo ;;
            run-sweep-*/convergence.csv) cut -d , -f 1,2,4 "$file" | cksum ;;
            */history.csv | */convergence.csv | */levels.csv) cut -d , -f 1-3 "$file" | cksum ;;
            # The caption tells how long it took.
            *.svg) grep -v ' s on ' "$file" | cksum ;;
            *) cksum <"$file" ;;
        esac | tr '\n' ' '
        echo "${file#"$1"/}"
    done
}

study() { # NAME ARGUMENTS...
    name=$1
    shift
    run "run-$name" "$@"
    sum "run-$name" >"$name.sum"
    if [ ! -f "$name.first" ]; then
        cp "$name.sum" "$name.first"
        echo "$peak" >"$name.peak"
    elif ! cmp -s "$name.sum" "$name.first"; then
        echo "round $round: $name came to something else:" >&2
        diff "$name.first" "$name.sum" >&2 || true
        failed=1
    fi
    echo "$peak" >>"$name.peaks"
    studies=$((studies + 1))
}

backends=simd
"$LAPSWARM" devices --json 2>/dev/null | grep -q '"name"' && backends="simd gpu"
failed=0
studies=0
round=0
began=$(date +%s)
rm -f ./*.first ./*.sum ./*.peak ./*.peaks
while [ $round -lt 2 ] || [ $(($(date +%s) - began)) -lt "$seconds" ]; do
    round=$((round + 1))
    for backend in $backends; do
        to="--backend $backend --memory-limit-mib $limit"
        # Words on purpose: the flags are several.
        # shellcheck disable=SC2086
        {
            study "identify-$backend" identify identify.toml $to
            study "front-$backend" identify identify.toml --objectives vx,yaw_rate $to
            study "raceline-$backend" raceline --track stadium:300:80:12 --sections 120 --population 24 \
                --iterations 20 --objectives length,lap_time $to
            study "thesis-$backend" raceline --track stadium:300:80:12 --sections 80 --population 24 \
                --iterations 40 --objectives gamma --algorithm thesis $to
            study "hybrid-$backend" hybrid --track stadium:300:80:12 --sections 120 --population 16 \
                --iterations 30 $to
            study "surface-$backend" surface --section Abbey --grid 24 $to
            study "sensitivity-$backend" sensitivity --section Abbey --parameters rBy1,rCy1,K --samples 32 $to
        }
    done
    study sweep-short sweep short.toml
    study sweep-long sweep long.toml
    echo "round $round: $studies studies, $(($(date +%s) - began)) s"
done

for peaks in *.peaks; do
    name=${peaks%.peaks}
    first=$(cat "$name.peak")
    most=$(sort -n "$peaks" | tail -1)
    echo "$name: $((first / 1024)) MiB in the first round, $((most / 1024)) MiB at the most"
    # Allocators and threads differ a little from run to run.
    if [ "$most" -gt $((first + first / 4 + 16384)) ]; then
        echo "$name: its memory grew" >&2
        failed=1
    fi
done
short=$(sort -n sweep-short.peaks | tail -1)
long=$(sort -n sweep-long.peaks | tail -1)
if [ "$long" -gt $((short + short / 4 + 16384)) ]; then
    echo "sixty studies in one process take $((long / 1024)) MiB, four $((short / 1024)) MiB" >&2
    failed=1
fi
echo "$studies studies in $round rounds and $(($(date +%s) - began)) s: $([ $failed = 0 ] && echo sound || echo NOT sound)"
exit $failed
