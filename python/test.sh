#!/bin/sh
# Builds the wheel, installs it into a clean virtual environment, and runs the tests, the docstrings, the examples and the type
# checks there. Needs Python 3.11 or later with venv, and a package index. WHEEL names a wheel that is built already.
#
#   test.sh         all but lapswarm.ray: under eight minutes on two cores, with the build
#   test.sh ray     lapswarm.ray alone, on a cluster of several nodes on this machine: under five minutes without the build
#   test.sh full    both
set -eu
cd "$(dirname "$0")"
tier=${1:-usual}
case $tier in
    usual | ray | full) ;;
    *)
        echo "usage: python/test.sh [ray|full]" >&2
        exit 2
        ;;
esac
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
python=$folder/venv/bin/python
"$python" -m pip install --quiet --disable-pip-version-check \
    maturin==1.16.0 mypy==2.4.1 numpy==2.4.6 optuna==5.0.0 pandas==3.1.1 polars==2.1.0 pyarrow==26.0.1 pymoo==0.6.2 \
    pytest==9.2.0
wheel=${WHEEL:-}
if [ -z "$wheel" ]; then
    "$folder/venv/bin/maturin" build --release --locked --out "$folder/dist"
    wheel=$(ls "$folder"/dist/*.whl)
fi
"$python" -m pip install --quiet --disable-pip-version-check --no-deps "$wheel"
# What is tested is the wheel: the folder beside has no native half, and would hide it.
here=$PWD
cp -r tests benches examples pyproject.toml "$folder"
cd "$folder"
if [ "$tier" != ray ]; then
    "$python" -m pytest -q -p no:cacheprovider tests
    "$python" -m pytest -q -p no:cacheprovider --doctest-modules --ignore-glob='*/lapswarm/ray/*' --pyargs lapswarm
    for example in examples/*.py; do
        echo "== $example"
        "$python" "$example"
    done
    "$folder/venv/bin/lapswarm" --version
    "$python" -m mypy --strict -p lapswarm
    "$python" -m mypy --strict examples benches/evaluate.py
fi
if [ "$tier" != usual ]; then
    # Not before: pytest reads what it finds of settings of tests, and these want Ray.
    cp -r "$here/tests_ray" "$folder"
    "$python" -m pip install --quiet --disable-pip-version-check fsspec==2026.9.0 ray==2.60.0
    "$python" -m pytest -q -p no:cacheprovider tests_ray
    "$python" -m mypy --strict -p lapswarm
    "$python" -m mypy --strict benches
fi
