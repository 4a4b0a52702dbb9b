#!/bin/sh
# Runs the unit tests of what is unsafe (lanes, their tables, the dispatch to instruction sets) under the address sanitizer.
# A stable toolchain does; on x86-64 Linux only, where the unsafe code is. Builds into a folder of its own.
set -eu
cd "$(dirname "$0")/.."
host=$(rustc -vV | sed -n 's/^host: //p')
case $host in
    x86_64-*-linux-gnu) ;;
    *)
        echo "The unsafe code is that of x86-64; nothing to do on $host." >&2
        exit 0
        ;;
esac
export RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zsanitizer=address" CARGO_INCREMENTAL=0
# Dependencies take the longest: as little as possible is made of them.
export CARGO_PROFILE_TEST_OPT_LEVEL=0 CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_PROFILE_DEV_DEBUG=line-tables-only
# Threads of drivers and pools live as long as the process.
export ASAN_OPTIONS=detect_leaks=0
exec cargo test --lib --target "$host" --target-dir target/sanitize -- scalar:: evaluate:: line:: swarm::problems --skip gpu
