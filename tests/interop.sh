#!/usr/bin/env bash
# A receiver that this project did not write, Debian's GNSS-SDR, must find the static scene's position to 5 m.
#
# usage: tests/interop.sh [GNSS_TWIN_BINARY]     (default: target/release/gnss-twin)
# exit:  0 the mean fix is within 5 m in three dimensions; 1 it is not; 75 gnss-sdr could not be installed.
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
