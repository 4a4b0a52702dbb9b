#!/bin/sh
# What a GPU makes of lapswarm, in a few minutes: devices, parity, tuning (remembered for this adapter), rates against population,
# whole generations from 1e3 to 1e6 particles, and a study of each kind. Writes one JSON and one Markdown file into a folder, for
# `benches/results/`.
#
#   benches/gpu.sh FOLDER [ADAPTER]           on the GPU whose name has ADAPTER in it, else on the first
#   SMALL=1 benches/gpu.sh FOLDER llvmpipe    small sizes, to try the script on a software driver
#
# LAPSWARM names the program, else it is built. Ends with 1 if a step failed, and keeps what the others found.
set -u
folder=${1:?a folder for the figures}
adapter=${2:-}
root=$(cd "$(dirname "$0")/.." && pwd)
if [ -z "${LAPSWARM:-}" ]; then
    cargo build --release --quiet --manifest-path "$root/Cargo.toml" || exit 1
    LAPSWARM=$root/target/release/lapswarm
fi
if [ -n "${SMALL:-}" ]; then
    populations=256,1024 whole=256,1024 longest=2 particles=64 iterations=10 tuned=1024
else
    populations=1000,10000,100000,1000000 whole=1000,10000,100000,1000000 longest=4 particles=16384 iterations=50 tuned=1048576
fi
mkdir -p "$folder" && cd "$folder" || exit 1
if [ -e gpu.json ]; then
    echo "$folder has figures: choose another folder" >&2
    exit 2
fi
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0
steps=

# Runs a step for at most so many seconds: JSON is kept, and words go into the page.
step() { # NAME SECONDS ARGUMENTS...
    name=$1 most=$2
    shift 2
    echo "$name: lapswarm $*" >&2
    began=$(date +%s)
    if ! timeout -s INT "$most" "$LAPSWARM" "$@" >"$work/$name.json" 2>"$work/$name.txt"; then
        echo "$name failed:" >&2
        tail -3 "$work/$name.txt" >&2
        echo '{"failed": true}' >"$work/$name.json"
        failed=1
    fi
    echo "$(($(date +%s) - began))" >"$work/$name.s"
    steps="$steps $name"
}
on() { # NAME SECONDS ARGUMENTS...: the same on the GPU alone
    if [ -n "$adapter" ]; then
        step "$@" --backend gpu --adapter "$adapter" --json
    else
        step "$@" --backend gpu --json
    fi
}

step devices 30 devices --json
"$LAPSWARM" devices >"$work/devices.txt" 2>/dev/null
on parity 120 parity
step tuning 120 bench tune ${adapter:+--adapter "$adapter"} --population "$tuned" --longest-s 0.05 --json
on rates 120 bench --problems replay,line,energy,drive,steady --populations "$populations" --longest-s "$longest"
on generations 120 bench whole --populations "$whole" --longest-s "$longest"
on identify 60 identify --section Abbey --population "$particles" --iterations "$iterations" --no-polish --out "$work/identify"
on envelope 60 envelope --out "$work/envelope"
# With room for the errors of the driver, who drives the fastest line below.
on raceline 90 raceline --objectives gamma,length,lap_time --margin-m 0.5 --population "$particles" \
    --iterations "$iterations" --out "$work/raceline"
on hybrid 60 hybrid --population "$particles" --iterations "$iterations" --out "$work/hybrid"
on transient 60 transient --line "$work/raceline/line_fastest.csv" --setups 63 --out "$work/transient"
on sensitivity 60 sensitivity --section Abbey --samples 256 --out "$work/sensitivity"
on surface 60 surface --section Abbey --grid 64 --out "$work/surface"

{
    echo "# lapswarm on a GPU"
    echo
    echo "$(date -u +%Y-%m-%d), $("$LAPSWARM" --version), $(uname -sm). Made by \`benches/gpu.sh\`."
    for name in $steps; do
        printf '\n## %s\n\n%s s.\n\n```text\n' "$name" "$(cat "$work/$name.s")"
        # Progress bars write over their lines.
        tr '\r' '\n' <"$work/$name.txt" | grep -v '^ *$' | tail -60
        printf '```\n'
    done
} >"gpu".md
{
    between='{'
    for name in $steps; do
        printf '%s\n"%s": ' "$between" "$name"
        cat "$work/$name.json"
        between=,
    done
    echo '}'
} >gpu.json
echo "$folder: gpu.json and a page of the same name" >&2
exit $failed
