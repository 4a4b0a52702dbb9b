#!/bin/sh
# All checks: format, lints, docs, tests. Installs a software Vulkan driver where apt is there, so that the GPU tests
# run on machines without a GPU; elsewhere it says what to do.
set -eu
cd "$(dirname "$0")/.."

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
    echo "Linuxes install Mesa's Vulkan drivers (lavapipe). Without one the GPU tests say that they are ignored." >&2
fi
# The Vulkan loader asks for it, though nothing here opens a window.
export XDG_RUNTIME_DIR="${XDG_RUNTIME_DIR:-${TMPDIR:-/tmp}}"

cargo fmt --check
cargo clippy --all-targets -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --quiet
cargo test --release
# Licences, duplicates and sources of dependencies, where the tool is there; advisories need the network and are left out.
if command -v cargo-deny >/dev/null 2>&1; then
    cargo deny --offline check licenses bans sources
fi
# The unsafe code by itself, where it is: seconds.
sh tests/sanitize.sh
