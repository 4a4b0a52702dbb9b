#!/bin/sh
# Runs fuzz targets one after the other: run.sh SECONDS [TARGET...]. A target that finds something is started anew until its
# time is up, so that one crash does not hide others. Prints a line for each: executions, edges covered, inputs kept, findings.
# FUZZ_BIN names a folder of built targets; without it they are built first.
set -eu
cd "$(dirname "$0")"
seconds=$1
shift
if [ -z "${FUZZ_BIN:-}" ]; then
    RUSTC_BOOTSTRAP=1 cargo fuzz build
    FUZZ_BIN=target/$(rustc -vV | sed -n 's/^host: //p')/release
fi
[ $# -gt 0 ] || set -- car maps tyre study sweep curvature track_csv boundaries latlon gpx_kml log_csv motec_csv \
    motec_ld envelope checkpoint state run_folder line survey sweep_rows
for target in "$@"; do
    mkdir -p "corpus/$target" "artifacts/$target"
    case $target in
        motec_ld) most=20000 ;;
        state | curvature) most=16384 ;;
        *) most=8192 ;;
    esac
    end=$(($(date +%s) + seconds))
    executions=0
    runs=0
    log=artifacts/$target.log
    : >"$log"
    # Twenty in one place are one.
    while left=$((end - $(date +%s))) && [ "$left" -gt 2 ] && [ "$runs" -lt 20 ]; do
        runs=$((runs + 1))
        "$FUZZ_BIN/$target" "corpus/$target" -max_total_time="$left" -rss_limit_mb=2048 -malloc_limit_mb=1024 \
            -timeout=120 -max_len="$most" -print_funcs=0 -print_final_stats=1 -artifact_prefix="artifacts/$target/" >"$log.last" 2>&1 || true
        done=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log.last")
        executions=$((executions + ${done:-0}))
        cat "$log.last" >>"$log"
    done
    covered=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$log" | sort -n | tail -1)
    kept=$(find "corpus/$target" -type f | wc -l)
    found=$(find "artifacts/$target" -type f | wc -l)
    rss=$(sed -n 's/^stat::peak_rss_mb: *//p' "$log" | sort -n | tail -1)
    echo "$target: $executions executions, $covered edges, $kept inputs, $found findings, at most $rss MiB"
done
