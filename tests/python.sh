#!/usr/bin/env bash
# The Python module as its users get it: a wheel is built and installed in a fresh environment, its tests, its stubs, its examples and
# two of its notebooks run there; with GNSS_TWIN_LONG all four.
#
# usage: tests/python.sh [PROFILE [OPT_LEVEL]]     (default: dev 1: the crates are compiled in half of the time, and quick enough)
# exit:  0 all of it holds; 1 it does not; 75 a package of Python could not be installed.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
profile=${1:-dev}
level=${2:-1}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/env"
bin=$work/env/bin
"$bin/pip" install --quiet --disable-pip-version-check 'maturin>=1.9.4,<2' numpy pytest mypy pandas polars \
    nbclient ipykernel matplotlib || {
    echo "python: cannot install maturin, numpy, pytest, mypy, pandas, polars, nbclient, ipykernel and matplotlib here" >&2
    exit 75
}
levels=()
for crate in fft gnss generator receiver analysis study; do
    levels+=(--config "profile.$profile.package.gnss-twin-$crate.opt-level=$level")
done
(cd "$root" && "$bin/maturin" build --quiet --locked --manifest-path python/Cargo.toml --profile "$profile" "${levels[@]}" \
    --out "$work/wheels")
"$bin/pip" install --quiet --disable-pip-version-check --no-deps "$work"/wheels/*.whl
# The wheel carries every licence: the project's, and those of crates, data and fonts.
licences=$(python3 -m zipfile -l "$work"/wheels/*.whl | grep -c 'dist-info/licenses/LICENSE-')
[ "$licences" -eq "$(ls "$root"/python/LICENSE-* | wc -l)" ]
# Elsewhere, so that what is tested is what was installed.
cd "$work"
"$bin/python" -m pytest -q -p no:cacheprovider "$root/python/tests"
# The stubs against what the module has, and the examples against the stubs.
"$bin/python" -m mypy.stubtest --ignore-missing-stub gnss_twin
"$bin/python" -m mypy "$root"/python/examples/*.py
"$bin/python" "$root/python/examples/acquire_recording.py" >acquired.txt
grep -E '^([6-9]|1[0-9]) satellites of 32 searched$' acquired.txt
"$bin/python" "$root/python/examples/sweep_loop_bandwidth.py" >swept.txt
[ "$(grep -c 'modelled:.*theory' swept.txt)" -eq 3 ]
"$bin/python" "$root/python/examples/fly_trajectory.py" 2 >flown.txt
grep -E '^[0-9]+ steps, largest gap 0\.0' flown.txt
# A notebook ends in assertions, and its execution fails with them.
notebooks=(loop_study own_receiver)
[ -z "${GNSS_TWIN_LONG:-}" ] || notebooks+=(first_fix jammer_sweep)
for notebook in "${notebooks[@]}"; do
    "$bin/jupyter" execute "$root/python/notebooks/$notebook.ipynb" >notebook.txt 2>&1 || { tail -n 40 notebook.txt; exit 1; }
done
if [ -n "${GNSS_TWIN_LONG:-}" ]; then
    "$bin/gnss-twin" run --quiet --report none --out run
    "$bin/python" "$root/python/notebooks/animate_run.py" run run.gif
    [ "$(head -c 6 run.gif)" = GIF89a ]
fi
echo "python: the wheel, its tests, stubs, examples and ${#notebooks[@]} notebooks hold"
