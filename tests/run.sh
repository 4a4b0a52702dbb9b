#!/bin/sh
# All checks, in two tiers. Times are on two cores, without the build; tests/README.md has them by target.
#
#   tests/run.sh         format, lints, docs, and the tests with every kernel's parity and every reader: about ten minutes
#   tests/run.sh full    also what takes long: kills, device faults, registers, whole identifications and searches, examples, a soak,
#                        licences, and the unsafe code under the address sanitizer: 20 to 40 minutes
#
# Installs a software Vulkan driver where apt is there, so that the GPU tests run on machines without a GPU; elsewhere it says
# what to do.
set -eu
cd "$(dirname "$0")/.."
tier=${1:-quick}
packages=
case $tier in
    quick) ignored= ;;
    full)
        ignored=--include-ignored
        # With the wheel's package, which has no tests in Rust, so that its build after this one finds the library built.
        packages="--package lapswarm --package lapswarm-python"
        ;;
    *)
        echo "usage: tests/run.sh [full]" >&2
        exit 2
        ;;
esac

if command -v apt-get >/dev/null 2>&1; then
    if ! ls /usr/share/vulkan/icd.d/*.json >/dev/null 2>&1; then
        sudo=$([ "$(id -u)" = 0 ] || echo sudo)
        $sudo apt-get update -qq
        $sudo apt-get install -y -qq mesa-vulkan-drivers libvulkan1
    fi
    # With a driver installed, a missing adapter is a fault and not a reason to skip.
    export LAPSWARM_REQUIRE_GPU=1
else
    echo "No apt here: the GPU tests need a Vulkan, Metal or DX12 driver. macOS and Windows have theirs; on other" >&2
    echo "Linuxes install Mesa's Vulkan drivers (lavapipe). Without one the GPU tests show as ignored." >&2
fi
# The Vulkan loader asks for it, though nothing here opens a window.
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}"

cargo fmt --check
cargo clippy --all-targets -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --quiet

results=$(mktemp -d)
trap 'rm -rf "$results"' EXIT
# Runs tests, shows what they say, and keeps it to be counted.
counted() {
    { "$@" 2>&1 || echo "$*" >>"$results/failed"; } | tee -a "$results/said"
}
# Words on purpose: packages are several.
# shellcheck disable=SC2086
counted cargo test --release --no-fail-fast $packages -- $ignored
if [ "$tier" = full ]; then
    # Features: every set that makes sense builds, with its tests, and a library of optimisers stays light.
    for features in '' gpu vehicle vehicle,gpu report studies; do
        counted cargo clippy --quiet --lib --tests --no-default-features --features "$features" -- -D warnings
    done
    crates=$(cargo tree --no-default-features --edges normal,build --no-dedupe --prefix none --format '{p}' | sort -u | wc -l)
    if [ "$crates" -ge 40 ]; then
        echo "$crates crates without features, under 40 expected" | tee -a "$results/failed" >&2
    fi
    # The unsafe code by itself, where it is: seconds.
    counted sh tests/sanitize.sh
    # The program that has just been tested.
    LAPSWARM=$PWD/target/release/lapswarm sh tests/soak.sh 60
    # Licences, duplicates and sources of dependencies, where the tool is there; advisories need the network and are left out.
    if command -v cargo-deny >/dev/null 2>&1; then
        cargo deny --offline check licenses bans sources
    fi
fi
# One line for all targets.
sed -n 's/^test result: .*\. \([0-9]*\) passed; \([0-9]*\) failed; \([0-9]*\) ignored;.*/\1 \2 \3/p' "$results/said" |
    awk '{ p += $1; f += $2; i += $3 } END { print p + 0 " passed, " f + 0 " failed, " i + 0 " skipped" }'
[ ! -e "$results/failed" ]
