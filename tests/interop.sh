#!/usr/bin/env bash
# A receiver that this project did not write, Debian's GNSS-SDR, must find the static scene's position to 5 m, and the judge must
# find from its RINEX and NMEA files what the scene put into them.
#
# usage: tests/interop.sh [GNSS_TWIN_BINARY]     (default: target/release/gnss-twin)
# exit:  0 the mean fix is within 5 m in three dimensions and every figure of the judgement within its bar; 1 it is not; 75 gnss-sdr could not be installed.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
twin=$(realpath "${1:-$root/target/release/gnss-twin}")
limit_m=5

if ! command -v gnss-sdr >/dev/null; then
    echo "interop: installing gnss-sdr"
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq gnss-sdr; } >/dev/null 2>&1 || {
        echo "interop: cannot install gnss-sdr here" >&2
        exit 75
    }
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
scene=$root/scenarios/static.toml
"$twin" generate "$scene" --out "$work/static.sigmf-data" --format ci8

value() { sed -n "s/^$1 *= *\([-0-9.e_]*\).*/\1/p" "$scene" | tr -d _ | head -n 1; }
rate_hz=$(awk -v r="$(value sample_rate_hz)" 'BEGIN { printf "%.0f", r }')
sed -e "s|@SAMPLES@|$work/static.sigmf-data|; s|@RATE_HZ@|$rate_hz|; s|@OUT@|$work|" \
    "$root/tests/interop/gnss-sdr.conf.in" >"$work/gnss-sdr.conf"
(cd "$work" && GLOG_minloglevel=2 timeout 600 gnss-sdr --config_file="$work/gnss-sdr.conf" --log_dir="$work" \
    </dev/null >"$work/stdout.txt" 2>"$work/stderr.txt") || {
    echo "interop: gnss-sdr failed" >&2
    tail -n 20 "$work/stderr.txt" "$work/stdout.txt" >&2
    exit 1
}
[ -s "$work/pvt.nmea" ] || { echo "interop: gnss-sdr found no position" >&2; exit 1; }

# Mean of all GGA fixes against the scene, in a local frame of the WGS 84 ellipsoid.
awk -F, -v lat0="$(value latitude_deg)" -v lon0="$(value longitude_deg)" -v h0="$(value height_m)" -v limit="$limit_m" '
    function degrees(text,   d) { d = int(text / 100); return d + (text - 100 * d) / 60 }
    $1 ~ /GGA$/ && $7 > 0 {
        lat = degrees($3); if ($4 == "S") lat = -lat
        lon = degrees($5); if ($6 == "W") lon = -lon
        n++; slat += lat; slon += lon; sh += $10 + $12
    }
    END {
        if (!n) { print "interop: no GGA fix"; exit 1 }
        rad = atan2(0, -1) / 180; s = sin(lat0 * rad); e2 = 0.00669437999014
        meridian = 6378137 * (1 - e2) / (1 - e2 * s * s) ^ 1.5
        normal = 6378137 / sqrt(1 - e2 * s * s)
        north = (slat / n - lat0) * rad * (meridian + h0)
        east = (slon / n - lon0) * rad * (normal + h0) * cos(lat0 * rad)
        up = sh / n - h0
        error = sqrt(east * east + north * north + up * up)
        printf "interop: GNSS-SDR, %d fixes, mean error east %+.2f north %+.2f up %+.2f m, 3-D %.2f m (limit %g m)\n", n, east, north, up, error, limit
        exit !(error <= limit)
    }' "$work/pvt.nmea"

# The same files before the judge. Bars:
# - every epoch has truth, and no satellite is another than the file says;
# - carriers and Dopplers drift with the sampler's clock, 5e-8: a Doppler's 0.3 Hz over 100 and more values is 0.03 Hz or 2e-11;
#   pseudoranges over 15 s: 0.5 m of a satellite's noise, correlated over 1 s, leaves 0.05 m/s or 2e-10;
# - what pseudoranges have in common is the sampler's clock to the error of a mean pseudorange, 3 m;
# - a time tag off by 1 ms would be 0.6 m in the pseudorange of a satellite at 600 m/s, twice its scatter's mean;
# - code loops of 0.5 Hz and 0.25 chips at 37 dB-Hz: 0.9 m; the bar is twice that. Phase loops of 10 Hz there: 0.04 rad or
#   0.0067 cycles; the bar is three times that;
# - C/N0: its estimator (second and fourth moments or SNV) is within 1 dB at these levels; 1.5 dB with the quantiser's loss.
gnss_sdr_obs=$(find "$work" -maxdepth 1 -name '*.[0-9][0-9]O' | head -n 1)
[ -n "$gnss_sdr_obs" ] || { echo "interop: gnss-sdr wrote no RINEX observations" >&2; exit 1; }
"$twin" analyze --truth "$work/static.truth" --rinex-obs "$gnss_sdr_obs" --nmea "$work/pvt.nmea" --out "$work/foreign"
figure() { sed -n "s/^ *\"$1\": *\([^,]*\),\{0,1\}$/\1/p" "$work/foreign/foreign.json" | head -n 1; }
failed=0
within() { # key, expected, bar
    awk -v key="$1" -v x="$(figure "$1")" -v want="$2" -v bar="$3" 'BEGIN {
        miss = x - want; if (miss < 0) miss = -miss
        good = x != "" && x != "null" && miss <= bar
        printf "interop: %-28s %14s, expected %s within %s%s\n", key, x, want, bar, good ? "" : ": FAILED"
        exit !good
    }' || failed=1
}
within observations_unmatched 0 0
within observations_outliers 0 0
within epochs_joined "$(figure epochs)" 0
within sampler_drift "$(value drift_sps)" 1e-12
within drift_carrier "$(value drift_sps)" 2e-11
within drift_doppler "$(value drift_sps)" 1e-10
within drift_code "$(value drift_sps)" 1e-9
within bias_mean_s "$(figure sampler_bias_mean_s)" 1e-8
within time_tag_offset_s 0 1e-3
within sigma_m 0 1.8
within rms_cycles 0 0.02
within scale 1 1e-4
within bias_db 0 1.5
within slips_undeclared 0 0
within horizontal_rms_m 0 5
exit "$failed"
