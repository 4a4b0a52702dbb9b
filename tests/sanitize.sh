#!/bin/sh
# Runs tests of what is unsafe (lanes, their tables, the dispatch to instruction sets) under the address sanitizer, with the
# standard library's own checks. A stable toolchain does; on x86-64 Linux only, where the unsafe code is.
#
#   sanitize.sh        the modules with unsafe code by themselves: seconds
#   sanitize.sh all    the library's unit tests that go through them: minutes, in a build folder of their own
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
export RUSTC_BOOTSTRAP=1
# Threads of drivers and pools live as long as the process.
export ASAN_OPTIONS=detect_leaks=0
if [ "${1:-}" = all ]; then
    export RUSTFLAGS="-Zsanitizer=address" CARGO_INCREMENTAL=0
    # Dependencies take the longest: as little as possible is made of them.
    export CARGO_PROFILE_TEST_OPT_LEVEL=0 CARGO_PROFILE_DEV_OPT_LEVEL=0 CARGO_PROFILE_DEV_DEBUG=line-tables-only
    exec cargo test --lib --target "$host" --target-dir target/sanitize -- scalar:: evaluate:: line:: swarm::problems --skip gpu
fi
mkdir -p target/sanitize
rustc --edition 2024 --test -Zsanitizer=address --target "$host" -C debug-assertions=on -C opt-level=1 -g \
    -o target/sanitize/unsafe_code tests/unsafe_code/alone.rs
exec target/sanitize/unsafe_code --quiet
