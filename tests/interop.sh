#!/usr/bin/env bash
# A receiver that this project did not write, Debian's GNSS-SDR, must find the position of the static scene, and that of the scene of
# two systems by Galileo alone and by GPS and Galileo, to 5 m. The judge must find from its RINEX and NMEA files what the scenes put
# into them. Debian's RTKLIB must find the static scene's place by the RINEX files that a run writes, of the receiver and of the truth;
# and by those of a truth without a troposphere to 0.01 m: of GPS and Galileo, and of two carriers of four systems through an ionosphere.
# RTKLIB's baseline of two receivers must be ours. It must fix the carriers of a base and a rover under one sky, those of the truth in
# the first epoch and those of the receivers within 2 s, to 3 mm horizontally and 6 mm up. georinex reads of those what the tables say.
# gpsdecode, pynmeagps and xmllint read NMEA, KML and GPX of fixes and truth,
# and pyarrow every table as Parquet.
#
# usage: tests/interop.sh [GNSS_TWIN_BINARY [galileo]]     (default: target/release/gnss-twin, and GPS alone)
# exit:  0 the mean fixes are within 5 m in three dimensions and every figure of the judgements within its bar; 1 they are not; 75 gnss-sdr could not be installed.
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

if ! command -v rnx2rtkp >/dev/null; then
    echo "interop: installing rtklib"
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq rtklib; } >/dev/null 2>&1 || {
        echo "interop: cannot install rtklib here" >&2
        exit 75
    }
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failed=0

value() { sed -n "s/^$1 *= *\([-0-9.e_]*\).*/\1/p" "$scene" | tr -d _ | head -n 1; }

# Generates the samples of the file in $scene as $work/NAME.
generate() { # name
    samples=$work/$1
    "$twin" generate "$scene" --out "$samples.sigmf-data" --format ci8 --gnss-sdr
}

# Runs GNSS-SDR over the samples, and holds the mean of its fixes to the scene's place and its files to what the judge expects.
foreign() { # name, channels of GPS and of Galileo, ionosphere, C/N0 beside the truth's and its bar
    local out=$work/$1 observations
    mkdir -p "$out"
    # The configuration as written beside the samples, with other channels where a comparison wants them.
    sed -e "s|^\(Channels_1C.count\)=.*|\1=$2|; s|^\(Channels_1B.count\)=.*|\1=$3|; s|^\(PVT.iono_model\)=.*|\1=$4|" \
        "$samples.gnss-sdr.conf" >"$out/gnss-sdr.conf"
    (cd "$out" && GLOG_minloglevel=2 timeout 600 gnss-sdr --config_file="$out/gnss-sdr.conf" --log_dir="$out" \
        </dev/null >"$out/stdout.txt" 2>"$out/stderr.txt") || {
        echo "interop: gnss-sdr failed on $1" >&2
        tail -n 20 "$out/stderr.txt" "$out/stdout.txt" >&2
        exit 1
    }
    [ -s "$out/pvt.nmea" ] || { echo "interop: gnss-sdr found no position of $1" >&2; exit 1; }
    place "$1" "$out/pvt.nmea"
    observations=$(find "$out" -maxdepth 1 -name '*.[0-9][0-9]O' | head -n 1)
    [ -n "$observations" ] || { echo "interop: gnss-sdr wrote no RINEX observations of $1" >&2; exit 1; }
    "$twin" analyze --truth "$samples.truth" --rinex-obs "$observations" --nmea "$out/pvt.nmea" --out "$out/foreign"
    judgement=$out/foreign/foreign.json
    bars "$5" "$6"
}

# Mean of all GGA fixes against the scene, in a local frame of the WGS 84 ellipsoid.
place() { # name, NMEA file
    awk -F, -v name="$1" -v lat0="$(value latitude_deg)" -v lon0="$(value longitude_deg)" -v h0="$(value height_m)" -v limit="$limit_m" '
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
            printf "interop: GNSS-SDR, %s, %d fixes, mean error east %+.2f north %+.2f up %+.2f m, 3-D %.2f m (limit %g m)\n", name, n, east, north, up, error, limit
            exit !(error <= limit)
        }' "$2" || failed=1
}

# The same files before the judge. Bars:
# - every epoch has truth, and no satellite is another than the file says;
# - carriers and Dopplers drift with the sampler's clock, 5e-8: a Doppler's 0.3 Hz over 100 and more values is 0.03 Hz or 2e-11;
#   pseudoranges over 15 s: 0.5 m of a satellite's noise, correlated over 1 s, leaves 0.05 m/s or 2e-10;
# - what pseudoranges have in common is the sampler's clock to the error of a mean pseudorange, 3 m;
# - a time tag off by 1 ms would be 0.6 m in the pseudorange of a satellite at 600 m/s, twice its scatter's mean;
# - code loops of 0.5 Hz and 0.25 chips at 37 dB-Hz: 0.9 m; the bar is twice that. Phase loops of 10 Hz there: 0.04 rad or
#   0.0067 cycles; the bar is three times that;
# - C/N0: its estimator (second and fourth moments or SNV) is within 1 dB at these levels; 1.5 dB with the quantiser's loss. A channel of Galileo
#   measures the pilot alone, half of E1's power: 3 dB less; of both systems the mean.
figure() { sed -n "s/^ *\"$1\": *\([^,]*\),\{0,1\}$/\1/p" "$judgement" | head -n 1; }
within() { # key, expected, bar
    awk -v key="$1" -v x="$(figure "$1")" -v want="$2" -v bar="$3" 'BEGIN {
        miss = x - want; if (miss < 0) miss = -miss
        good = x != "" && x != "null" && miss <= bar
        printf "interop: %-28s %14s, expected %s within %s%s\n", key, x, want, bar, good ? "" : ": FAILED"
        exit !good
    }' || failed=1
}
bars() { # C/N0 beside the truth's, and its bar
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
    within bias_db "$1" "$2"
    within slips_undeclared 0 0
    within horizontal_rms_m 0 5
}

# RTKLIB's single points, by the broadcast ionosphere and Saastamoinen's troposphere unless told otherwise, epoch by epoch.
rtklib() { # name, directory of the files, bar in m, options
    printf '%s\n' pos1-posmode=single pos1-elmask=5 pos1-ionoopt=brdc pos1-tropopt=saas out-solformat=llh out-timeform=hms \
        out-height=ellipsoidal "${@:4}" >"$work/rtklib.conf"
    rnx2rtkp -k "$work/rtklib.conf" -o "$work/$1.pos" "$2/observations.rnx" "$2"/navigation*.rnx 2>/dev/null
    awk -v name="$1" -v lat0="$(value latitude_deg)" -v lon0="$(value longitude_deg)" -v h0="$(value height_m)" -v limit="$3" \
        -v epochs="$(grep -c '^>' "$2/observations.rnx")" '
        !/^%/ && $6 == 5 { n++; slat += $3; slon += $4; sh += $5 }
        END {
            if (n < 0.9 * epochs || !n) { printf "interop: RTKLIB, %s: %d positions of %d epochs\n", name, n, epochs; exit 1 }
            rad = atan2(0, -1) / 180; s = sin(lat0 * rad); e2 = 0.00669437999014
            north = (slat / n - lat0) * rad * (6378137 * (1 - e2) / (1 - e2 * s * s) ^ 1.5 + h0)
            east = (slon / n - lon0) * rad * (6378137 / sqrt(1 - e2 * s * s) + h0) * cos(lat0 * rad)
            up = sh / n - h0
            error = sqrt(east * east + north * north + up * up)
            printf "interop: RTKLIB, %s: %d positions of %d epochs, mean error east %+.3f north %+.3f up %+.3f m, 3-D %.3f m (limit %g m)\n", name, n, epochs, east, north, up, error, limit
            exit !(error <= limit)
        }' "$work/$1.pos" || failed=1
}

scene=$root/scenarios/static.toml
"$twin" run "$scene" --out "$work/run" >/dev/null
rtklib receiver "$work/run/rx" 1.5
rtklib truth "$work/run/truth" 1.5
# What is left of the truth is the troposphere: RTKLIB divides its zenith delay by the cosine of the zenith angle, 13 % too much at
# 5 degrees. Without one, ranges printed to 1 mm leave 0.3 mm times a dilution of 3 an epoch, and places printed to 1e-9 degrees
# 0.1 mm: with the same ionosphere, clocks, group delays and rotation of the Earth 0.01 m is left for nothing.
bare=$work/bare.toml
sed -e '/^\[troposphere\]/d; /^model = "saastamoinen"/d; s/^duration_s = .*/duration_s = 27/; s/^sample_rate_hz = .*/sample_rate_hz = 1.1e6/' \
    "$scene" >"$bare"
"$twin" generate "$bare" --out "$work/bare.sigmf-data" --rinex --quiet 2>/dev/null
rtklib bare "$work/bare.truth" 0.01 pos1-tropopt=off
# The same of two systems at once, and by Galileo alone (RTKLIB's numbers of systems: 1 and 8), without an ionosphere.
for system in 9 8; do
    scene=$work/both.toml
    sed -e '/^\[troposphere\]/d; /^model = "saastamoinen"/d; /^\[ionosphere\]/d; /^model = "nequick_g"/d; s/^duration_s = .*/duration_s = 27/; s/^sample_rate_hz = .*/sample_rate_hz = 4.2e6/' \
        "$root/scenarios/two_systems.toml" >"$scene"
    [ -d "$work/both.truth" ] || "$twin" generate "$scene" --out "$work/both.sigmf-data" --rinex --quiet 2>/dev/null
    rtklib "both_$system" "$work/both.truth" 0.01 pos1-tropopt=off pos1-ionoopt=off "pos1-navsys=$system"
done
# Two carriers of each satellite, through an ionosphere that nothing else corrects: GPS L1 C/A and L2C, Galileo E1 and E5b, GLONASS G1
# and G2, BeiDou B1I and B2I (RTKLIB's pairs; it knows no other of Galileo and BeiDou), each system alone (1, 8, 4, 32) and all as one.
# Nine seconds have the four strings of GLONASS's sets; those of GPS and Galileo are of the run before. The combination has 3 times the
# 0.3 mm of each range, a dilution of 3 makes 3 mm of it in an epoch.
"$twin" scenes glonass_two_bands --out "$work/four" >/dev/null
scene=$work/four/four.toml
{
    sed -e '/^#/d; /^\[troposphere\]/d; /^model = "saastamoinen"/d; /^\[noise\]/d; /^\[receiver.position\]/,$d' \
        -e 's/^start = .*/start = 2020-11-29T12:50:48/; s/^duration_s = .*/duration_s = 9/' \
        -e 's/^signals = .*/signals = ["GPS L1 C\/A", "GPS L2C", "Galileo E1", "Galileo E5b", "GLONASS G1", "GLONASS G2", "BeiDou B1I", "BeiDou B2I"]/' \
        "$work/four/glonass_two_bands.toml"
    # Name, middle and rate: just the main lobes.
    printf '\n[[front_end]]\nname = "%s"\ncenter_hz = %s\nsample_rate_hz = %s\nformat = "ci8"\n' \
        l1 1575.42e6 4.2e6 b1 1561.098e6 4.2e6 l2 1227.60e6 2.6e6 b2 1207.14e6 21.3e6
} >"$scene"
"$twin" generate "$scene" --out "$work/bands" --rinex --quiet 2>/dev/null
rm -f "$work"/bands/*.sigmf-data
cp "$work/both.truth/navigation.rnx" "$work/bands/truth/navigation_before.rnx"
for system in 1 8 4 32 45; do
    rtklib "bands_$system" "$work/bands/truth" 0.01 pos1-tropopt=off pos1-ionoopt=dual-freq pos1-frequency=l1+l2 "pos1-navsys=$system"
done
# Two receivers 600 m apart: RTKLIB's baseline and ours by the same files, against both truths. Fixed epochs of both are right to 3 mm
# horizontally and 6 mm up, and differ by 12 mm at most, each with its own weights. They are at nearly one height: RTKLIB's mean error
# in height is 6.5 mm where they are 12 m apart in height, and 4.9 mm where they are 2 m apart; ours is 0.4 mm in both.
for name in base rover; do
    at=(37.605 -0.986 60 1.3e-4 5)
    [ "$name" = base ] || at=(37.609 -0.9815 62 -2.2e-4 6)
    sed -e "s/^latitude_deg = .*/latitude_deg = ${at[0]}/; s/^longitude_deg = .*/longitude_deg = ${at[1]}/; s/^height_m = .*/height_m = ${at[2]}/" \
        -e "s/^bias_s = .*/bias_s = ${at[3]}/; s/^seed = .*/seed = ${at[4]}/; s/^duration_s = .*/duration_s = 45/" \
        -e "s|igrg3380.10i.gz|$root/scenarios/igrg3380.10i.gz|" "$root/scenarios/dual_band.toml" >"$work/$name.toml"
    "$twin" run "$work/$name.toml" --allow-outside --level correlations --out "$work/$name" --quiet
done
"$twin" baseline "$work/base" "$work/rover" --check --out "$work/baseline" | sed 's/^/interop: baseline, /' || failed=1
read -r x y z < <(awk -F, 'NR == 2 { print $4, $5, $6 }' "$work/base/truth/trajectory.csv")
printf '%s\n' pos1-posmode=kinematic pos1-frequency=l1+2+3 pos1-elmask=10 pos1-ionoopt=off pos1-tropopt=off pos1-navsys=8 \
    pos2-armode=continuous pos2-arthres=3 out-solformat=enu out-timeform=tow out-timesys=gpst out-timendec=3 \
    ant2-postype=xyz "ant2-pos1=$x" "ant2-pos2=$y" "ant2-pos3=$z" >"$work/baseline.conf"
# Of I/NAV and F/NAV with one issue RTKLIB keeps any, and uses I/NAV alone: data sources 513 to 517.
awk '!body { print; body = /END OF HEADER/; next }
    { record = record $0 "\n"; if (++row % 8 == 6) keep = / 5\.1[0-9]+E\+02 /; if (row % 8 == 0) { if (keep) printf "%s", record; record = "" } }' \
    "$work/rover/rx/navigation.rnx" >"$work/baseline.nav"
rnx2rtkp -k "$work/baseline.conf" -o "$work/baseline.pos" "$work/rover/rx/observations.rnx" "$work/base/rx/observations.rnx" \
    "$work/baseline.nav" >"$work/rnx2rtkp.log" 2>&1
python3 - "$work" <<'END' || failed=1
import csv, math, sys

work = sys.argv[1]
ours = {}
with open(f"{work}/baseline/baseline.csv", newline="") as stream:
    for row in csv.DictReader(stream):
        if row["status"] in ("fixed", "partial"):
            hours, minutes, seconds = row["time"].split("T")[1].split(":")
            second = round(3600 * int(hours) + 60 * int(minutes) + float(seconds), 1)
            own = [float(row[f"{axis}_m"]) for axis in ("east", "north", "up")]
            ours[second] = own, [value - float(row[f"error_{axis}_m"]) for value, axis in zip(own, ("east", "north", "up"))]
fixed, squares, apart = 0, [0.0] * 3, 0.0
for line in open(f"{work}/baseline.pos"):
    words = line.split()
    if line.startswith("%") or words[5] != "1":
        continue
    found = ours.get(round(float(words[1]) % 86400, 1))
    if found:
        place = [float(word) for word in words[2:5]]
        fixed += 1
        squares = [sum_ + (one - true) ** 2 for sum_, one, true in zip(squares, place, found[1])]
        apart = max(apart, math.dist(place, found[0]))
rms = [math.sqrt(one / max(fixed, 1)) for one in squares]
print(f"interop: RTKLIB's baseline, {fixed} fixed epochs, rms {rms[0]:.4f} {rms[1]:.4f} {rms[2]:.4f} m, from ours {apart:.4f} m at most")
sys.exit(not (fixed > 100 and math.hypot(rms[0], rms[1]) <= 0.003 and rms[2] <= 0.006 and apart <= 0.012))
END
# A base and a rover under one sky, each received by itself: RTKLIB fixes carriers early, one of them or both,
# epoch by epoch, and the rover lies where the scene puts it. Carriers of 2 to 3 mm in four of a double difference and a dilution of
# 2 in height are within the bars, which are those of a receiver on the market: 3 mm horizontally and 6 mm up.
"$twin" run "$root/scenarios/rtk_static.toml" --report none --out "$work/pair" >/dev/null 2>&1
fixed() { # name, directory below each station's, bands, mode
    printf '%s\n' "pos1-posmode=$4" "pos1-frequency=$3" pos1-elmask=10 pos1-ionoopt=brdc pos1-tropopt=saas pos2-armode=continuous \
        pos2-arthres=3 out-solformat=enu out-timeform=tow ant2-postype=xyz $(python3 - "$work/pair/stations.json" <<'END'
import json, sys

base = json.load(open(sys.argv[1]))["stations"][0]
print(" ".join(f"ant2-pos{axis}={value!r}" for axis, value in zip("123", base["start_ecef_m"])))
END
        ) >"$work/pair.conf"
    rnx2rtkp -k "$work/pair.conf" -o "$work/$1.pos" "$work/pair/rover/$2/observations.rnx" "$work/pair/base/$2/observations.rnx" \
        "$work"/pair/*/truth/navigation.rnx 2>/dev/null
    python3 - "$1" "$work/pair/stations.json" "$work/$1.pos" "$(grep -c '^>' "$work/pair/rover/$2/observations.rnx")" <<'END' || failed=1
import json, math, sys

name, stations, path, epochs = sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4])
base, rover = (station["start_ecef_m"] for station in json.load(open(stations))["stations"][:2])
x, y, z = base
# Geodetic latitude of the WGS 84 ellipsoid by iteration.
e2, p = 0.00669437999014, math.hypot(x, y)
latitude = math.atan2(z, p * (1 - e2))
for _ in range(9):
    normal = 6378137 / math.sqrt(1 - e2 * math.sin(latitude) ** 2)
    latitude = math.atan2(z + e2 * normal * math.sin(latitude), p)
longitude = math.atan2(y, x)
(sl, cl), (sb, cb) = (math.sin(longitude), math.cos(longitude)), (math.sin(latitude), math.cos(latitude))
d = [b - a for a, b in zip(base, rover)]
truth = [-sl * d[0] + cl * d[1], -sb * cl * d[0] - sb * sl * d[1] + cb * d[2], cb * cl * d[0] + cb * sl * d[1] + sb * d[2]]
rows = [line.split() for line in open(path) if not line.startswith("%")]
fixed = [[float(value) for value in row[2:5]] for row in rows if row[5] == "1"]
rms = [math.sqrt(sum((fix[axis] - truth[axis]) ** 2 for fix in fixed) / max(len(fixed), 1)) for axis in range(3)]
late = next((number for number, row in enumerate(rows) if row[5] == "1"), len(rows))
# The receivers' first epochs have few satellites.
patience = 0 if "truth" in name else 20
print(f"interop: RTKLIB, {name}: {len(fixed)} of {epochs} epochs fixed, the first {late / 10:.1f} s after the first position, "
      f"rms east {rms[0] * 1e3:.1f} north {rms[1] * 1e3:.1f} up {rms[2] * 1e3:.1f} mm")
sys.exit(not (late <= patience and len(fixed) > 0.95 * epochs and math.hypot(rms[0], rms[1]) <= 3e-3 and rms[2] <= 6e-3))
END
}
for mode in kinematic static; do
    fixed "pair_${mode}_truth" truth l1+l2 "$mode"
    fixed "pair_${mode}_two" rx l1+l2 "$mode"
    fixed "pair_${mode}_one" rx l1 "$mode"
done
scene=$root/scenarios/static.toml
# And what reads XML and NMEA: no word of theirs on standard error, every fix a position.
if ! command -v xmllint >/dev/null || ! command -v gpsdecode >/dev/null; then
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq libxml2-utils gpsd-clients; } >/dev/null 2>&1 || {
        echo "interop: cannot install xmllint and gpsdecode here" >&2
        exit 75
    }
fi
xmllint --noout "$work/run/rx/fixes.kml" "$work/run/rx/fixes.gpx" "$work/run/truth/trajectory.kml" "$work/run/truth/trajectory.gpx" || failed=1
fixes=$(($(wc -l <"$work/run/rx/fixes.csv") - 1))
sentences=$(gpsdecode <"$work/run/rx/fixes.nmea" | grep -c '"class":"TPV".*"mode":3' || true)
points=$(grep -c '<trkpt' "$work/run/rx/fixes.gpx" || true)
echo "interop: gpsdecode read $sentences positions of $fixes fixes; $points points in the track"
[ "$sentences" -ge $((fixes - 1)) ] && [ "$points" -ge $((fixes / 10)) ] || failed=1
places=$(($(wc -l <"$work/run/truth/trajectory.csv") - 1))
# A report has one place a second of the sentences' time, the last one alone without the next to end it.
told=$(gpsdecode <"$work/run/truth/trajectory.nmea" | grep -c '"class":"TPV".*"mode":3' || true)
echo "interop: gpsdecode read $told positions of $places of the truth"
[ "$told" -ge $((places - 1)) ] || failed=1
# The shipped files by the schemas that their first lines name.
python=python3
if ! "$python" -c 'import jsonschema' 2>/dev/null; then
    # Debian's module is for Debian's own interpreter.
    python=/usr/bin/python3
    { apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq python3-jsonschema; } >/dev/null 2>&1 || {
        echo "interop: cannot install python3-jsonschema here" >&2
        exit 75
    }
fi
"$python" "$root/tests/schema.py" || failed=1
"$twin" scenes ionex extremes/leo trajectory_file --out "$work/copies" >/dev/null
"$twin" init "$work/copies/mine.toml" >/dev/null
"$python" "$root/tests/schema.py" "$work/copies" || failed=1
for copy in "$work"/copies/*.toml; do "$twin" plan "$copy" >/dev/null 2>&1 || { echo "interop: plan $copy failed"; failed=1; }; done
generate static
# The metadata beside the samples by SigMF's own validator, which is to refuse a data type that there is not.
python3 -m venv "$work/sigmf" && "$work/sigmf/bin/pip" install --quiet --disable-pip-version-check sigmf pynmeagps pyarrow georinex || {
    echo "interop: cannot install sigmf, pynmeagps, pyarrow and georinex here" >&2
    exit 75
}
# What RTKLIB read of four systems, by georinex: every figure of half a second and the sets' elements are those of the tables.
"$work/sigmf/bin/python" - "$work/bands/truth" 2020-11-29T12:50:48 <<'END' || failed=1
import csv, datetime, math, sys, warnings

import georinex
import numpy

warnings.simplefilter("ignore")
truth, start = sys.argv[1], datetime.datetime.fromisoformat(sys.argv[2])
CODES = {"GPS L1 C/A": "1C", "GPS L2C": "2L", "Galileo E1": "1C", "Galileo E5b": "7Q", "GLONASS G1": "1C", "GLONASS G2": "2C",
         "BeiDou B1I": "2I", "BeiDou B2I": "7I"}
with open(f"{truth}/observations.csv", newline="") as stream:
    rows = list(csv.DictReader(stream))
samples = sorted({int(row["sample"]) for row in rows})[:5]
found = georinex.load(f"{truth}/observations.rnx", tlim=(start, start + datetime.timedelta(seconds=0.45)))
compared = wrong = 0
for row in rows:
    if int(row["sample"]) not in samples:
        continue
    at = found.isel(time=samples.index(int(row["sample"]))).sel(sv=row["sv"])
    for kind, column in (("C", "pseudorange_m"), ("L", "carrier_cycles"), ("D", "doppler_hz"), ("S", "cn0_dbhz")):
        compared += 1
        wrong += float(at[kind + CODES[row["signal"]]]) != float(f"{float(row[column]):.3f}")
print(f"interop: georinex read {compared} observations of {len(found.sv)} satellites, {wrong} other than in the CSV")
# Elements whose scales LNAV, I/NAV and D1 share, and places of GLONASS.
SCALES = {"sqrt_a_sqrtm": ("sqrtA", 2.0**-19), "eccentricity": ("Eccentricity", 2.0**-33), "m0_rad": ("M0", math.pi * 2.0**-31),
          "i0_rad": ("Io", math.pi * 2.0**-31), "x_km": ("X", 1e3 * 2.0**-11), "y_km": ("Y", 1e3 * 2.0**-11), "z_km": ("Z", 1e3 * 2.0**-11)}
sets = [georinex.load(f"{truth}/{name}.rnx") for name in ("navigation", "navigation_before")]
elements = off = 0
with open(f"{truth}/navigation.csv", newline="") as stream:
    for row in csv.DictReader(stream):
        if row["parameter"] not in SCALES or row["message"].startswith("CNAV"):
            continue
        name, scale = SCALES[row["parameter"]]
        values = [value for read in sets if row["sv"] in read.sv for value in read[name].sel(sv=row["sv"]).values.flat]
        elements += 1
        # Twelve digits after the first are printed.
        off += not any(math.isclose(value, int(row["raw"]) * scale, rel_tol=1e-12, abs_tol=1e-15) for value in values)
print(f"interop: georinex read {elements} elements, {off} other than in the CSV")
sys.exit(not (compared > 1000 and elements > 60 and wrong == off == 0))
END
# Sentences by a parser that checks every sum and type: how far its places are from the scene's.
"$work/sigmf/bin/python" - "$work/run/truth/trajectory.nmea" "$(value latitude_deg)" "$(value longitude_deg)" "$(value height_m)" "$places" <<'END' || failed=1
import sys
from pynmeagps import ERR_RAISE, NMEAReader, VALCKSUM

path, latitude, longitude, height, places = sys.argv[1], *map(float, sys.argv[2:])
with open(path, "rb") as stream:
    read = [parsed for _, parsed in NMEAReader(stream, quitonerror=ERR_RAISE, validate=VALCKSUM)]
fixes = [parsed for parsed in read if parsed.msgID == "GGA"]
worst = max(max(abs(fix.lat - latitude), abs(fix.lon - longitude)) * 1.1132e5 + abs(fix.alt + fix.sep - height) for fix in fixes)
kinds = sorted({parsed.msgID for parsed in read})
print(f"interop: pynmeagps read {len(fixes)} places of {len(read)} sentences ({' '.join(kinds)}), {worst * 1000:.3f} mm off")
# Written to 1e-7 of a minute and 0.1 mm.
sys.exit(not (len(fixes) == places and worst < 1e-3 and kinds == ["GGA", "GSA", "GSV", "RMC", "VTG", "ZDA"]))
END
# Every table of the run as Parquet, by Arrow's reader: names, rows and values of the CSV beside it, of which a number has all its
# digits and an empty cell is null.
"$twin" parquet "$work/run" >/dev/null
"$work/sigmf/bin/python" - "$work/run" <<'END' || failed=1
import csv, math, pathlib, sys
import pyarrow.parquet

tables = cells = wrong = 0
for path in sorted(pathlib.Path(sys.argv[1]).rglob("*.csv")):
    header, *rows = csv.reader(path.open(newline=""))
    table = pyarrow.parquet.read_table(path.with_suffix(".parquet"))
    columns = table.to_pydict()
    tables += 1
    wrong += list(columns) != header or table.num_rows != len(rows)
    for place, name in enumerate(header):
        for row, value in zip(rows, columns[name]):
            cells += 1
            text = row[place]
            if value is None or text == "":
                wrong += value is not None or text != ""
            elif isinstance(value, bool):
                wrong += text != str(value).lower()
            elif isinstance(value, str):
                wrong += text != value
            else:
                wrong += type(value)(text) != value and not (math.isnan(value) and math.isnan(float(text)))
print(f"interop: pyarrow read {tables} tables, {cells} cells, {wrong} other than in the CSV")
sys.exit(not (tables >= 10 and cells > 10_000 and wrong == 0))
END
sed 's/"ci8"/"ci9"/' "$work/static.sigmf-meta" >"$work/wrong.sigmf-meta"
ln "$work/static.sigmf-data" "$work/wrong.sigmf-data"
"$work/sigmf/bin/sigmf_validate" "$work/static.sigmf-meta" || { echo "interop: sigmf_validate refuses our metadata"; failed=1; }
! "$work/sigmf/bin/sigmf_validate" "$work/wrong.sigmf-meta" 2>/dev/null || { echo "interop: sigmf_validate takes anything"; failed=1; }
foreign static 12 0 Broadcast 0 1.5

# Galileo on demand: that receiver's searches drop what they have no time for, so that a busy machine finds no place.
if [[ ${2:-} != galileo ]]; then
    exit "$failed"
fi

# As short and slow as gives Galileo's first fix after 37 s and that of both after 49 s.
scene=$work/two_systems.toml
# Without its ionosphere: that receiver corrects by none before page 18 has come, 9 m of height.
sed -e 's/^duration_s = .*/duration_s = 57/; s/^sample_rate_hz = .*/sample_rate_hz = 4.5e6/; /^\[ionosphere\]/d; /^model = "nequick_g"/d' \
    "$root/scenarios/two_systems.toml" >"$scene"
generate two_systems
foreign galileo 0 9 OFF -3 1.5
foreign both 9 9 OFF -1.5 2
exit "$failed"
