#!/usr/bin/env bash
# Pages in Chromium: the report of a run whose scene has the name of a script, that of a foreign receiver, that of a study, and a live run.
#
# usage: tests/page.sh [GNSS_TWIN_BINARY]     (default: target/release/gnss-twin)
# needs: Node.js with npm; chromium, which is installed on Debian where it is missing
# exit:  0 every law of page.mjs, study.mjs and live.mjs holds on each page
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
twin=$(realpath "${1:-$root/target/release/gnss-twin}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

command -v chromium >/dev/null || { apt-get update -qq && apt-get install -y -qq chromium >/dev/null; }
# The lock file names each package with its hash.
cp "$root"/tests/page/{package.json,package-lock.json,browser.mjs,laws.mjs,page.mjs,study.mjs,live.mjs} "$work/"
cd "$work"
if [ -n "${SHOTS:-}" ]; then mkdir -p "$SHOTS"/{foreign,study}; fi
npm ci --silent --no-audit --no-fund

# Satellites' messages are complete after 36 s; some fixes follow. A run's files may be another's: the name and the text of the scene
# are scripts.
name='<script>alert(1)</script>'
sed -e 's/^duration_s = .*/duration_s = 45/' -e 's/^#:schema.*//' "$root/scenarios/two_systems.toml" >scene.toml
"$twin" run scene.toml --out run --quiet --report none
sed -i "s|\"two_systems\"|\"$name\"|" run/truth/scene.json
printf '# </pre></script><script>alert(2)</script><img src=x onerror=alert(3)>\n' >>run/scenario.toml
# A report of an older verdict does not stay beside the new one.
printf '%%PDF-1.7 gnss-twin 0.0.0\n' >run/report.pdf
"$twin" analyze run --quiet --report html
[ ! -e run/report.pdf ] || { echo "page: --report html wrote or left a PDF" >&2; exit 1; }
node page.mjs run/report.html --title "$name" ${SHOTS:+--shots "$SHOTS"}

limit=1500000
size=$(stat -c %s run/report.html)
[ "$size" -le "$limit" ] || { echo "page: $size bytes, at most $limit are allowed" >&2; exit 1; }

# Ten seconds are too few for a fix: some plots have nothing.
sed 's/^duration_s = .*/duration_s = 10/' scene.toml >short.toml
"$twin" run short.toml --out short --quiet --report html
node page.mjs short/report.html
left=$(grep -o 'Left out, because this run has no data for them: [^<]*' short/report.html) ||
  { echo "page: no plot of nothing is left out" >&2; exit 1; }
! grep -qE '_|allan' <<<"$left" || { echo "page: names of files in place of words: $left" >&2; exit 1; }
grep -q 'class="banner strong">Passed: .*; no fix in 10 s, position not judged<' short/report.html ||
  grep -q 'class="banner \(bad\|caution\)">.*; no fix in 10 s, position not judged<' short/report.html ||
  { echo "page: the banner of a run without a fix says nothing of it, or is green" >&2; exit 1; }

# The run's own records, judged as another receiver's.
"$twin" analyze --truth run/truth --rinex-obs run/rx/observations.rnx --nmea run/rx/fixes.nmea --out foreign --quiet
for words in 'GPS time' 'figure-front-sky' 'what was judged' 'horizontal error, 95 %'; do
  grep -q "$words" foreign/foreign_report.html || { echo "page: nothing of \"$words\" on a foreign receiver's page" >&2; exit 1; }
done
node page.mjs foreign/foreign_report.html ${SHOTS:+--shots "$SHOTS/foreign"}

# A study in words that are scripts: a map of 21 cells, curves beside theory and a crossing.
cat >study.toml <<END
name = "page"
title = "$name"
about = "</script><img src=x onerror=alert(2)> & words of others."
level = "correlator"
seed = 1
repetitions = 3
keep = ["code_sigma_m", "phase_sigma_deg"]

[measure]
settle_s = 1
duration_s = 4

[[axis]]
key = "receiver.tracking.spacing_chips"
values = [0.25, 0.5, 1.0]
label = "<b>spacing</b> (chips)"

[[axis]]
key = "signal.cn0_dbhz"
from = 30
to = 48
step = 3
label = "C/N0 (dB-Hz)"

[[plot]]
kind = "heat"
title = "<script>alert(3)</script> code jitter"
x = "signal.cn0_dbhz"
y = "receiver.tracking.spacing_chips"
z = "code_sigma_m"
log_y = true

[[plot]]
title = "Code jitter"
x = "signal.cn0_dbhz"
y = "code_sigma_m"
series = "receiver.tracking.spacing_chips"
log_y = true

[[plot]]
title = "Phase jitter"
x = "signal.cn0_dbhz"
y = "phase_sigma_deg"
series = "receiver.tracking.spacing_chips"

[[plot]]
kind = "crossing"
title = "C/N0 at which the code's jitter is 1 m"
x = "receiver.tracking.spacing_chips"
along = "signal.cn0_dbhz"
z = "code_sigma_m"
level = 1.0
END
"$twin" study study.toml --out study --report html >study.log
[ ! -e study/report.pdf ] || { echo "page: --report html wrote a PDF" >&2; exit 1; }
node study.mjs study/report.html --title "$name" --cells 21 ${SHOTS:+--shots "$SHOTS/study"}

# A live run, and its receiver on the same page.
cat >live.toml <<END
name = "live_page"
start = 2010-07-01T08:06:00
duration_s = 90
motion = { kind = "pushed", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }
[[interference]]
kind = "cw"
offset_hz = 500e3
js_db = 10
END
lines=$((20000 + RANDOM % 10000))
samples=$((lines + 1))
"$twin" live live.toml --clock host --latency 500 --to "tcp:$samples" --web 0 --web-receiver "tcp:$lines" 2>live.log &
run=$!
trap 'kill "$run" 2>/dev/null || true; rm -rf "$work"' EXIT
for _ in $(seq 100); do
  url=$(sed -n 's|.*page: \(http://.*\)|\1|p' live.log)
  [ -z "$url" ] || break
  sleep 0.1
done
"$twin" receive "tcp:$samples" --format ci8 --rate-hz 2600000 --start 2010-07-01T08:06:00 --json "tcp:$lines" --live --out live_rx \
  >receive.log 2>&1 &
node live.mjs "$url" --title live_page --receiver ${SHOTS:+--shots "$SHOTS"}
kill "$run"
wait
