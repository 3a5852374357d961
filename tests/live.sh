#!/usr/bin/env bash
# Programs that this project did not write take the twin's samples while they are made: Debian's GNSS-SDR by FIFO and by rtl_tcp, whose
# fixes must lie within 5 m of the scene's place, and Debian's hackrf_transfer on a stand-in for its library (tests/live/hackrf.c), which
# plays buffers at the sample rate, keeps the bytes and counts shortfalls. The receiver's NMEA is read by gpsd's gpsdecode. Beside them, in
# real time, a circle is pushed with jitter, losses and lateness to our own receiver by TCP.
#
# usage: tests/live.sh [GNSS_TWIN_BINARY [long]]     (default: target/release/gnss-twin; long: a whole minute to each receiver)
# exit:  0 all hold; 1 one does not; 75 a program could not be installed.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
twin=$(realpath "${1:-$root/target/release/gnss-twin}")
limit_m=5
# Bits are found by 15 s, subframes 1 to 3 come from 18 s to 36 s.
duration_s=46
if [[ ${2:-} == long ]]; then duration_s=90; fi

need() { # program, package
    command -v "$1" >/dev/null && return
    echo "live: installing $2"
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq "$2"; } >/dev/null 2>&1 || {
        echo "live: cannot install $2 here" >&2
        exit 75
    }
}
need gnss-sdr gnss-sdr
need hackrf_transfer hackrf
need gpsdecode gpsd-clients

work=$(mktemp -d)
children=()
end() {
    for child in "${children[@]}"; do kill "$child" 2>/dev/null || true; done
    rm -rf "$work"
}
trap end EXIT
failed=0
fail() {
    echo "live: FAILED: $*"
    failed=1
}

scene=$work/scene.toml
# Without its ionosphere: that receiver corrects by none before page 18 has come.
sed -e "s/^start = .*/start = 2010-07-01T08:05:42/; s/^duration_s = .*/duration_s = $duration_s/; /^\[ionosphere\]/d; /^model = \"klobuchar\"/d" \
    "$root/scenarios/static.toml" >"$scene"
value() { sed -n "s/^$1 *= *\([-0-9.e_]*\).*/\1/p" "$scene" | tr -d _ | head -n 1; }
rate_hz=$(awk -v r="$(value sample_rate_hz)" 'BEGIN { printf "%.0f", r }')

# The address at which a program of ours listens.
address() { # its standard error, and for what
    local found=
    for _ in $(seq 200); do
        found=$(sed -n "s/.*${2:-}: listening on //p" "$1" | head -n 1)
        [ -n "$found" ] && break
        sleep 0.05
    done
    echo "$found"
}

# Mean of the positions that GNSS-SDR prints against the scene, in a local frame of the WGS 84 ellipsoid.
place() { # name, standard output
    sed -n 's/.*Lat = \([-0-9.]*\) \[deg\], Long = \([-0-9.]*\) \[deg\], Height = *\([-0-9.]*\) \[m\].*/\1 \2 \3/p' "$2" |
        awk -v name="$1" -v lat0="$(value latitude_deg)" -v lon0="$(value longitude_deg)" -v h0="$(value height_m)" -v limit="$limit_m" '
        { n++; slat += $1; slon += $2; sh += $3 }
        END {
            if (n < 2) { printf "live: %s: %d positions, expected 2 and more\n", name, n; exit 1 }
            rad = atan2(0, -1) / 180; s = sin(lat0 * rad); e2 = 0.00669437999014
            north = (slat / n - lat0) * rad * (6378137 * (1 - e2) / (1 - e2 * s * s) ^ 1.5 + h0)
            east = (slon / n - lon0) * rad * (6378137 / sqrt(1 - e2 * s * s) + h0) * cos(lat0 * rad)
            up = sh / n - h0
            error = sqrt(east * east + north * north + up * up)
            printf "live: %s: %d positions, mean error east %+.2f north %+.2f up %+.2f m, 3-D %.2f m (limit %g m)\n", name, n, east, north, up, error, limit
            exit !(error <= limit)
        }' || {
        fail "$1"
        tail -n 5 "$2"
    }
}

# GNSS-SDR on the twin's samples while they are made. Its reader of a FIFO goes on for ever at the end, so that it is ended here.
foreign() { # name, --out of the twin, lines of the signal source, format
    local out=$work/$1 twin_is sdr_is address
    mkdir -p "$out"
    mkfifo "$out/keys"
    exec 9<>"$out/keys"
    "$twin" generate "$scene" --out "$2" --format "$4" 2>"$out/twin.txt" &
    twin_is=$!
    children+=("$twin_is")
    if [[ $2 == rtl-tcp:* ]]; then address=$(address "$out/twin.txt"); else address=; fi
    sed -e "/^SignalSource\./d; /^DataTypeAdapter\./d; s|@RATE_HZ@|$rate_hz|; s|@OUT@|$out|; s|@GPS@|12|; s|@GALILEO@|0|; s|@IONOSPHERE@|OFF|" \
        "$root/assets/gnss-sdr.conf.in" >"$out/gnss-sdr.conf"
    {
        echo "DataTypeAdapter.implementation=Pass_Through"
        echo "DataTypeAdapter.item_type=gr_complex"
        echo "SignalSource.sampling_frequency=$rate_hz"
        sed "s|@PORT@|${address##*:}|" <<<"$3"
    } >>"$out/gnss-sdr.conf"
    (cd "$out" && GLOG_minloglevel=2 exec stdbuf -oL gnss-sdr --config_file="$out/gnss-sdr.conf" --log_dir="$out" <"$out/keys" >"$out/stdout.txt" 2>"$out/stderr.txt") &
    sdr_is=$!
    children+=("$sdr_is")
    wait "$twin_is" || fail "$1: the twin ended with $?: $(tail -n 1 "$out/twin.txt")"
    # What it still has in its buffers, then its key to stop.
    sleep 2
    echo q >&9
    for _ in $(seq 100); do kill -0 "$sdr_is" 2>/dev/null || break; sleep 0.1; done
    kill -KILL "$sdr_is" 2>/dev/null && echo "live: gnss-sdr did not stop by itself"
    # It aborts as it stops reading from rtl_tcp; its files may lack their ends then, and what it printed does not.
    wait "$sdr_is" 2>/dev/null || true
    exec 9>&-
    place "GNSS-SDR by $1" "$out/stdout.txt"
}

# Pushed motion, live, to our own receiver: a circle of 100 m that is entered smoothly, a hundred states a second, each up to 30 ms late, one in
# twenty lost. Times are those of a clock that shares no start with the scene's. What comes of it is judged at the end.
flight_s=34
flight() {
    local out=$work/flight at line now wait begun pause
    mkdir -p "$out"
    printf 'name = "flight"\nstart = 2010-07-01T08:05:58\nduration_s = %s\nseed = 1\nnoise = {}\nsatellites = { mask_deg = 5 }\n' "$flight_s" >"$out/scene.toml"
    printf 'motion = { kind = "pushed", latitude_deg = 48.1, longitude_deg = 11.6, height_m = 520 }\n' >>"$out/scene.toml"
    printf 'front_end = { sample_rate_hz = 2.6e6, format = "ci8" }\n' >>"$out/scene.toml"
    printf '[position]\nionosphere = "none"\ntroposphere = "none"\n' >"$out/settings.toml"
    # When each state is sent, in microseconds, and the state: of 1000 s and more by its own clock.
    awk -v seconds="$flight_s" 'BEGIN {
        srand(7); rad = atan2(0, -1) / 180; lat = 48.1 * rad; lon = 11.6 * rad; h = 520; a = 6378137; e2 = 0.00669437999014
        n = a / sqrt(1 - e2 * sin(lat) ^ 2); x0 = (n + h) * cos(lat) * cos(lon); y0 = (n + h) * cos(lat) * sin(lon); z0 = (n * (1 - e2) + h) * sin(lat)
        r = 100; w0 = 0.2; up = 8
        for (k = 0; k < seconds * 100; k++) {
            t = k / 100; u = (t - 2) / up
            if (u <= 0) { th = w = dw = 0 }
            else if (u < 1) { th = w0 * up * (2.5 * u ^ 4 - 3 * u ^ 5 + u ^ 6); w = w0 * u ^ 3 * (10 - 15 * u + 6 * u * u); dw = w0 / up * 30 * u * u * (1 - u) ^ 2 }
            else { th = w0 * up * (0.5 + u - 1); w = w0; dw = 0 }
            sent = t + 0.03 * rand(); if (sent < last) sent = last; last = sent
            if (rand() < 0.05 && k > 0) continue
            s = sin(th); c = cos(th)
            printf "%d %.3f", sent * 1e6, 1000 + t
            put(r * s, r * (1 - c), 1); put(r * w * c, r * w * s, 0); put(r * (dw * c - w * w * s), r * (dw * s + w * w * c), 0)
            printf "\n"
        }
    }
    function put(east, north, place) {
        printf " %.9f %.9f %.9f", place * x0 - east * sin(lon) - north * sin(lat) * cos(lon), place * y0 + east * cos(lon) - north * sin(lat) * sin(lon), place * z0 + north * cos(lat)
    }' >"$out/states"
    "$twin" live "$out/scene.toml" --clock host --latency 200 --motion udp:0 --motion-time first --to tcp:0 --record "$out/record" 2>"$out/live.txt" &
    local live_is=$!
    local to; to=$(address "$out/live.txt" motion); to=${to#udp:}
    "$twin" receive "tcp:$(address "$out/live.txt" samples)" --format ci8 --rate-hz 2600000 --start 2010-07-01T08:05:58 --live \
        --receiver "$out/settings.toml" --out "$out/rx" >"$out/rx.txt" 2>&1 &
    local rx_is=$!
    mkfifo "$out/never"
    exec 7<>"$out/never" 8>"/dev/udp/${to%:*}/${to##*:}"
    sleep 1
    begun=${EPOCHREALTIME//[.,]/}
    while read -r at line; do
        now=${EPOCHREALTIME//[.,]/}
        wait=$((at + begun - now))
        if ((wait > 0)); then
            printf -v pause '0.%06d' "$wait"
            read -r -t "$pause" -u 7 || true
        fi
        printf '%s' "$line" >&8 2>/dev/null || break
    done <"$out/states"
    wait "$live_is" || { echo "live ended with $?"; tail -n 1 "$out/live.txt"; }
    wait "$rx_is" || { echo "receive ended with $?"; tail -n 3 "$out/rx.txt"; }
}

# What came of the flight.
landed() {
    local out=$work/flight
    [ -d "$out/record" ] && [ -d "$out/rx" ] || { fail "flight: $(cat "$out/../flight.txt" 2>/dev/null | tail -n 3)"; return; }
    mv "$out/rx" "$out/record/rx"
    cat >"$out/limits.toml" <<'LIMITS'
"position.first_fix_s" = { max = 30 }
"position.fixes" = { min = 40 }
"position.horizontal_p95_m" = { max = 1.0 }
"position.vertical_p95_m" = { max = 1.5 }
[tracking]
losses_of_lock = { max = 0 }
cycle_slips = { max = 0 }
LIMITS
    "$twin" analyze "$out/record" --check "$out/limits.toml" >"$out/judged.txt" 2>&1 || { fail "flight: the judge of the pushed circle"; tail -n 20 "$out/judged.txt"; }
    # The joined motion may not depart from what was pushed by more than a millimetre, which a step in it would.
    number() { sed -n "s/.*\"$1\": \([-0-9.e]*\).*/\1/p" "$out/record/live.json" | head -n 1; }
    echo "live: pushed circle: $(number taken) states taken, $(number extrapolated) ticks extrapolated, $(number snap) snaps, worst gap $(number worst_gap_m) m"
    [ "$(number snap)" = 0 ] || fail "flight: a snap"
    awk -v gap="$(number worst_gap_m)" 'BEGIN { exit !(gap < 1e-3) }' || fail "flight: $(number worst_gap_m) m from the pushed motion"
    awk -v taken="$(number taken)" -v extrapolated="$(number extrapolated)" 'BEGIN { exit !(taken > 2500 && extrapolated > 50) }' ||
        fail "flight: losses and lateness were not exercised"
}

flight >"$work/flight.txt" 2>&1 &
flight_is=$!
children+=("$flight_is")

mkfifo "$work/if"
foreign fifo "fifo:$work/if" "SignalSource.implementation=Fifo_Signal_Source
SignalSource.filename=$work/if
SignalSource.sample_type=ibyte" ci8
# Its settings take ports below 32768.
foreign rtl_tcp "rtl-tcp:$((20000 + $$ % 10000))" "SignalSource.implementation=RtlTcp_Signal_Source
SignalSource.item_type=gr_complex
SignalSource.address=127.0.0.1
SignalSource.port=@PORT@
SignalSource.freq=1575420000
SignalSource.AGC_enabled=true
SignalSource.gain=40
SignalSource.rf_gain=40
SignalSource.if_gain=40
SignalSource.swap_iq=false" cu8

# Our own receiver by TCP, whose NMEA a program reads that this project did not write.
"$twin" generate "$scene" --out tcp:0 2>"$work/twin.txt" &
children+=($!)
printf '[position]\nionosphere = "none"\n' >"$work/settings.toml"
"$twin" receive "tcp:$(address "$work/twin.txt")" --format ci8 --rate-hz "$rate_hz" --start 2010-07-01T08:05:42 --live --nmea "$work/rx.nmea" \
    --receiver "$work/settings.toml" --out "$work/rx" >/dev/null 2>&1 || fail "receive ended with $?"
fixes=$(($(wc -l <"$work/rx/fixes.csv") - 1))
gpsdecode <"$work/rx.nmea" >"$work/rx.json"
# Mode 3 is a position with height. It gives an epoch once the next has begun.
decoded=$(grep -c '"class":"TPV".*"mode":3' "$work/rx.json" || true)
skies=$(grep -c '"class":"SKY".*"uSat":12' "$work/rx.json" || true)
echo "live: gpsdecode: $decoded positions and $skies skies with twelve satellites used, of $fixes fixes"
[ "$fixes" -ge 50 ] && [ "$decoded" -ge $((fixes - 1)) ] && [ "$skies" -ge $((fixes - 1)) ] || fail "gpsdecode: expected as many as fixes"
sed -n 's/.*"mode":3.*"lat":\([-0-9.]*\),"lon":\([-0-9.]*\),"altHAE":\([-0-9.]*\),.*/Lat = \1 [deg], Long = \2 [deg], Height = \3 [m]/p' \
    "$work/rx.json" >"$work/rx.places"
place "our NMEA by gpsdecode" "$work/rx.places"

wait "$flight_is" || true
cat "$work/flight.txt"
landed

# A transmitter in real time, with a stall on the way to it.
count=$((5 * rate_hz / 2))
"$twin" generate "$scene" --out "$work/plain.sigmf-data" --format ci8 --samples "$count" >/dev/null
cc -O1 -shared -fPIC -Wl,-soname,libhackrf.so.0 -o "$work/libhackrf.so.0" "$root/tests/live/hackrf.c" -lpthread
stall() { head -c 6000000; sleep "$1"; cat; }
transmit() { # stall in seconds
    "$twin" generate "$scene" --out - --samples "$count" 2>/dev/null | stall "$1" |
        HACKRF_BYTES=$work/sent HACKRF_REPORT=$work/report LD_LIBRARY_PATH=$work hackrf_transfer -t - -f 1575420000 -s "$rate_hz" \
            2>"$work/hackrf.txt" >&2
    cmp "$work/sent" "$work/plain.sigmf-data" || fail "hackrf_transfer: other bytes than generate's"
    shortfalls=$(sed -n 's/^shortfalls=//p' "$work/report")
    echo "live: hackrf_transfer, stall of $1 s: $(stat -c %s "$work/sent") bytes as generated, $(tr '\n' ' ' <"$work/report")"
}
# Its queue is 202 ms long here. A busy machine may stall it for the rest of that too, which is no fault of the twin's: one in three is enough.
for _ in 1 2 3; do
    transmit 0.05
    if [ "$shortfalls" = 0 ]; then break; fi
done
[ "$shortfalls" = 0 ] || fail "hackrf_transfer: a shortfall at a stall of 50 ms"
transmit 0.5
[ "$shortfalls" -ge 1 ] || fail "hackrf_transfer: no shortfall at a stall of 500 ms"

exit "$failed"
