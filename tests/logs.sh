#!/usr/bin/env bash
# Logs of real receivers, and the program's own RTCM 3, against other programs' readings (tests/logs.py), in an environment of its own.
#
# usage: tests/logs.sh PROGRAM
# exit:  0 all of it holds; 1 it does not; 75 a package of Python or RTKLIB could not be installed.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
if ! command -v convbin >/dev/null || ! command -v str2str >/dev/null || ! command -v rnx2rtkp >/dev/null; then
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq rtklib; } >/dev/null 2>&1 || {
        echo "logs: cannot install rtklib here" >&2
        exit 75
    }
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/env"
"$work/env/bin/pip" install --quiet --disable-pip-version-check pyubx2==1.4.0 pyrtcm==1.2.1 pysbf2==1.0.7 pynmeagps==1.1.8 || {
    echo "logs: cannot install pyubx2, pyrtcm and pysbf2 here" >&2
    exit 75
}
"$work/env/bin/python" "$root/tests/logs.py" "$1"
