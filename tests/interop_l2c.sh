#!/usr/bin/env bash
# A receiver that this project did not write, Debian's GNSS-SDR, on L2C: it must track every satellite of a scene, decode sets of CNAV
# of four and more, and find a place by L2C alone.
#
# usage: tests/interop_l2c.sh [GNSS_TWIN_BINARY]     (default: target/release/gnss-twin)
# exit:  0 all of that; 1 not; 75 gnss-sdr could not be installed.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
twin=$(realpath "${1:-$root/target/release/gnss-twin}")
# GNSS-SDR adds the group delay TGD where IS-GPS-200N, 30.3.3.3.1.1.1, subtracts it: by the file's own delays its place is 24.5 m low,
# as twice the mean delay predicts (24.7 m). So the scene has delays of zero, by which it is 1.9 m off in all (measured); the bar is twice
# that and more.
limit_m=5

if ! command -v gnss-sdr >/dev/null; then
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq gnss-sdr; } >/dev/null 2>&1 || {
        echo "interop: cannot install gnss-sdr here" >&2
        exit 75
    }
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# The seventh line of a GPS record has TGD third (RINEX 3.05, table A6).
awk '/^G[0-9][0-9] / { line = 0 } { line++ }
    body && line == 7 { $0 = substr($0, 1, 42) " 0.000000000000e+00" substr($0, 62) }
    /END OF HEADER/ { body = 1 }
    { print }' "$root/scenarios/gps_2025-08-21_06h_08h.rnx" >"$work/gps_2025-08-21_06h_08h.rnx"
cat >"$work/l2c.toml" <<'SCENE'
name = "l2c"
start = 2025-08-21T07:51:56
duration_s = 90
seed = 7
signals = ["GPS L2C"]
motion = { kind = "static", latitude_deg = 35.342, longitude_deg = 139.522, height_m = 50 }
navigation = { file = "gps_2025-08-21_06h_08h.rnx" }
satellites = { mask_deg = 10 }
power = { kind = "link_budget" }
troposphere = { model = "saastamoinen" }
receiver_clock = { bias_s = 1.3e-4, drift_sps = 5e-8 }
noise = {}
front_end = { center_hz = 1227.6e6, sample_rate_hz = 2.6e6, format = "ci8" }
SCENE
"$twin" generate "$work/l2c.toml" --out "$work/l2c.sigmf-data"

# The template's channels of L1 and E1 make way for eight of L2C, each for a satellite of the scene: searches are of 20 ms.
sed -e '/_1C/d; /_1B/d; /^Channels\.in_acquisition/d' -e "s|@RATE_HZ@|2600000|; s|@SAMPLES@|$work/l2c.sigmf-data|; s|@ITEM@|ibyte|" \
    -e 's|@ADAPTER@|Ibyte_To_Complex|; s|@IONOSPHERE@|OFF|; s|@OUT@|.|' "$root/assets/gnss-sdr.conf.in" >"$work/gnss-sdr.conf"
cat >>"$work/gnss-sdr.conf" <<'CONF'
Channels_2S.count=8
Channels.in_acquisition=8
Acquisition_2S.implementation=GPS_L2_M_PCPS_Acquisition
Acquisition_2S.item_type=gr_complex
Acquisition_2S.coherent_integration_time_ms=20
Acquisition_2S.pfa=0.001
Acquisition_2S.doppler_max=3500
Acquisition_2S.doppler_step=25
Acquisition_2S.blocking=true
Tracking_2S.implementation=GPS_L2_M_DLL_PLL_Tracking
Tracking_2S.item_type=gr_complex
Tracking_2S.order=3
Tracking_2S.pll_bw_hz=6.0
Tracking_2S.dll_bw_hz=0.5
Tracking_2S.early_late_space_chips=0.5
TelemetryDecoder_2S.implementation=GPS_L2C_Telemetry_Decoder
CONF
channel=0
for number in 10 12 15 23 24 25 28 32; do
    printf 'Channel%d.signal=2S\nChannel%d.satellite=%d\n' $channel $channel $number >>"$work/gnss-sdr.conf"
    channel=$((channel + 1))
done
(cd "$work" && GLOG_minloglevel=2 timeout 600 gnss-sdr --config_file=gnss-sdr.conf --log_dir=. </dev/null >stdout.txt 2>stderr.txt) || {
    echo "interop: gnss-sdr failed on L2C" >&2
    tail -n 20 "$work/stderr.txt" "$work/stdout.txt" >&2
    exit 1
}

count() { { grep -oE "$1 GPS PRN [0-9]+" "$work/stdout.txt" || true; } | sort -u | wc -l; }
tracked=$({ grep -oE "L2C signal started on channel [0-9]+ for satellite GPS PRN [0-9]+" "$work/stdout.txt" || true; } |
    grep -oE '[0-9]+$' | sort -u | wc -l)
sets=$(count "ephemeris from satellite")
echo "interop: GNSS-SDR, L2C: $tracked of 8 satellites tracked, sets of CNAV of $sets"
failed=0
[ "$tracked" -eq 8 ] && [ "$sets" -ge 4 ] || failed=1
[ -s "$work/pvt.nmea" ] || { echo "interop: gnss-sdr found no position by L2C" >&2; exit 1; }
awk -F, -v limit="$limit_m" '
    function degrees(text,   d) { d = int(text / 100); return d + (text - 100 * d) / 60 }
    $1 ~ /GGA$/ && $7 > 0 { n++; lat += degrees($3); lon += degrees($5); h += $10 + $12 }
    END {
        if (!n) { print "interop: no GGA fix"; exit 1 }
        # Metres of a degree at 35.3 degrees north.
        north = (lat / n - 35.342) * 110950; east = (lon / n - 139.522) * 90920; up = h / n - 50
        error = sqrt(east * east + north * north + up * up)
        printf "interop: GNSS-SDR, L2C, %d fixes, mean error east %+.1f north %+.1f up %+.1f m, 3-D %.1f m (limit %g m)\n", n, east, north, up, error, limit
        exit !(error <= limit)
    }' "$work/pvt.nmea" || failed=1
exit "$failed"
