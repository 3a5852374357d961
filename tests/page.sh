#!/usr/bin/env bash
# Reports as pages in Chromium: of a run whose scene has the name of a script, and of a foreign receiver.
#
# usage: tests/page.sh [GNSS_TWIN_BINARY]     (default: target/release/gnss-twin)
# needs: Node.js with npm; chromium, which is installed on Debian where it is missing
# exit:  0 every law of page.mjs holds on each page
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
twin=$(realpath "${1:-$root/target/release/gnss-twin}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

command -v chromium >/dev/null || { apt-get update -qq && apt-get install -y -qq chromium >/dev/null; }
# The lock file names each package with its hash.
cp "$root"/tests/page/{package.json,package-lock.json,page.mjs} "$work/"
cd "$work"
npm ci --silent --no-audit --no-fund

# Satellites' messages are complete after 36 s; some fixes follow. A run's files may be another's: the name and the text of the scene
# are scripts.
name='<script>alert(1)</script>'
sed -e 's/^duration_s = .*/duration_s = 45/' -e 's/^#:schema.*//' "$root/scenarios/two_systems.toml" >scene.toml
"$twin" run scene.toml --out run --quiet --report none
sed -i "s|\"two_systems\"|\"$name\"|" run/truth/scene.json
printf '# </pre></script><script>alert(2)</script><img src=x onerror=alert(3)>\n' >>run/scenario.toml
"$twin" analyze run --quiet --report html
[ ! -e run/report.pdf ] || { echo "page: --report html wrote a PDF" >&2; exit 1; }
node page.mjs run/report.html --title "$name" ${SHOTS:+--shots "$SHOTS"}

limit=1500000
size=$(stat -c %s run/report.html)
[ "$size" -le "$limit" ] || { echo "page: $size bytes, at most $limit are allowed" >&2; exit 1; }

# The run's own records, judged as another receiver's.
"$twin" analyze --truth run/truth --rinex-obs run/rx/observations.rnx --nmea run/rx/fixes.nmea --out foreign --quiet
node page.mjs foreign/foreign_report.html ${SHOTS:+--shots "$SHOTS/foreign"}
