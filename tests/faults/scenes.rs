//! Texts with every key that a scenario, the receiver's settings, limits or a study may have, each on a line
//! of its own.

/// Scenes for the keys that none of those has that come with the program. They are read, not composed.
pub const SCENES: [(&str, &str); 6] = [
    ("link", LINK),
    ("front end", FRONT_END),
    ("interference", INTERFERENCE),
    ("faults", FAULTS),
    ("reflections", REFLECTIONS),
    ("turning", TURNING),
];

const LINK: &str = r#"name = "link"
start = 2010-07-01T08:05:58
duration_s = 10
seed = 3
signals = ["GPS L1 C/A"]
[navigation]
file = "nav.rnx"
[satellites]
mask_deg = 5
exclude = ["G01"]
include_unhealthy = false
[motion]
kind = "static"
latitude_deg = 26.5
longitude_deg = 80.2
height_m = 130
[power]
kind = "link_budget"
transmit = "typical"
transmit_dbw = 14.3
antenna = "table"
antenna_file = "antenna.csv"
noise_figure_db = 2
loss_db = 1
[ionosphere]
model = "constant_tec"
vtec_tecu = 20
shell_km = 400
mapping = "single_layer"
broadcast_alpha = [1e-8, 0, 0, 0]
broadcast_beta = [1e5, 0, 0, 0]
[troposphere]
model = "saastamoinen"
height_m = 130
pressure_hpa = 1000
temperature_c = 15
relative_humidity = 0.5
mapping = "niell"
[scintillation]
s4 = 0.5
sigma_phi_rad = 1.5
decorrelation_s = 0.8
[receiver_clock]
bias_s = 1e-4
drift_sps = 1e-7
ageing_per_day = 1e-9
sensitivity_per_g = 1e-9
power_law = [0, 0, 1e-20, 1e-22, 1e-24]
[truth]
interval_s = 0.1
[fidelity]
level = "fast"
code_edge = "area"
knot_tolerance_cycles = 1e-4
"#;

const FRONT_END: &str = r#"name = "front_end"
start = "2010-07-01T08:05:58"
duration_s = 10
[motion]
kind = "orbit"
semi_major_axis_m = 7e6
eccentricity = 0.01
inclination_deg = 50
node_longitude_deg = 10
argument_of_perigee_deg = 20
mean_anomaly_deg = 30
[front_end]
sample_rate_hz = 4e6
if_hz = 1000
spectrum_inverted = true
format = "ci16"
noise_lsb = 100
[power]
kind = "fixed"
cn0_dbhz = 45
[noise]
[playback]
bits = 8
load_sigma = 4.5
attenuation_db = 3
[local_oscillator]
offset_hz = 100
phase_noise_rad = 0.02
phase_noise_bandwidth_hz = 2000
[filter]
kind = "brick_wall"
bandwidth_hz = 2.4e6
[iq]
gain_db = 0.3
phase_deg = 2
dc_i_lsb = 1.5
dc_q_lsb = 0.5
[adc]
bits = 2
step_sigma = 0.9
agc_window_s = 0.005
"#;

const INTERFERENCE: &str = r#"name = "interference"
start = 2010-07-01T08:05:58
duration_s = 10
[motion]
kind = "rocket"
latitude_deg = 26.5
longitude_deg = 80.2
height_m = 130
azimuth_deg = 125
elevation_deg = 80
ignition_s = 4
thrust_mps2 = 200
burn_s = 5
jerk_mps3 = 100
drag_m2pkg = 4e-5
gravity = "central"
[power]
cn0_dbhz = 45
[[interference]]
kind = "fmcw"
offset_hz = 1e5
js_db = 20
sweep_hz = 2e6
sweep_s = 1e-4
on_s = 1
off_s = 5
[[interference]]
kind = "sine_fm"
deviation_hz = 1e5
rate_hz = 100
eirp_dbw = -20
latitude_deg = 26.6
longitude_deg = 80.3
height_m = 150
[[interference]]
kind = "noise"
power_dbw = -110
bandwidth_hz = 2e6
[[interference]]
kind = "recording"
js_db = 10
file = "noise.ci8"
format = "ci8"
sample_rate_hz = 1e6
repeat = true
[[spoofer]]
power_db = 3
power_start_db = -10
ramp_s = 4
on_s = 1
off_s = 9
satellites = ["G03"]
clock_bias_s = 1e-6
clock_drift_sps = 1e-9
[spoofer.drag]
start_s = 4
azimuth_deg = 45
elevation_deg = 10
speed_mps = 5
acceleration_mps2 = 1
"#;

const FAULTS: &str = r#"name = "faults"
start = 2010-07-01T08:05:58
duration_s = 10
[motion]
kind = "waypoints"
acceleration_mps2 = 2
jerk_mps3 = 2
turn_radius_m = 20
[[motion.point]]
latitude_deg = 26.5
longitude_deg = 80.2
height_m = 130
speed_mps = 0
hold_s = 5
[[motion.point]]
latitude_deg = 26.51
longitude_deg = 80.21
height_m = 130
speed_mps = 5
[[satellite_fault]]
kind = "clock_step"
satellites = ["G03"]
step_s = 1e-7
on_s = 1
off_s = 5
[[satellite_fault]]
kind = "clock_ramp"
satellites = ["G03"]
drift_sps = 1e-9
[[satellite_fault]]
kind = "clock_noise"
oscillator = "tcxo"
[[satellite_fault]]
kind = "orbit"
satellites = ["G03"]
radial_m = 3
along_m = 4
cross_m = 5
on_s = 1
ramp_s = 5
[[message_fault]]
kind = "bit_errors"
rate = 1e-3
on_s = 1
off_s = 5
[[message_fault]]
kind = "bit"
subframe = 1
word = 3
bit = 5
[[message_fault]]
kind = "health"
satellites = ["G03"]
health = 5
"#;

const REFLECTIONS: &str = r#"name = "reflections"
start = 2010-07-01T08:05:58
duration_s = 10
[motion]
kind = "file"
file = "ride.csv"
format = "csv"
max_gap_s = 1.5
[orbits]
sp3 = "orbits.sp3"
antenna_offset_m = 0.7
[city]
file = "street.city.json"
lod = "2"
radius_m = 200
material = "brick"
order = 2
diffraction = false
cross_polar_db = 12
[[multipath]]
kind = "given"
amplitude = 0.5
phase_deg = 90
excess_m = 20
rate_mps = 0.1
satellites = ["G03"]
[[multipath]]
kind = "ground"
amplitude = 0.5
height_m = 2
[[multipath]]
kind = "wall"
amplitude = 0.5
azimuth_deg = 80
distance_m = 20
[[obstruction]]
kind = "sector"
from_deg = 10
to_deg = 50
roof_deg = 30
edge_deg = 1
loss_db = 20
[[obstruction]]
kind = "building"
east_m = [5, 20]
north_m = [-5, 20]
top_m = 15
[[obstruction]]
kind = "horizon"
azimuth_deg = [0, 90]
elevation_deg = [5, 10]
"#;

const TURNING: &str = r#"name = "turning"
start = 2010-07-01T08:05:58
duration_s = 10
[motion]
kind = "waypoints"
turn_acceleration_mps2 = 3
[[motion.point]]
latitude_deg = 26.5
longitude_deg = 80.2
height_m = 130
speed_mps = 3
[[motion.point]]
latitude_deg = 26.51
longitude_deg = 80.21
height_m = 130
speed_mps = 5
[city]
file = "street.city.json"
permittivity = 5
conductivity_spm = 0.05
latitude_deg = 26.5
longitude_deg = 80.2
height_m = 128
origin_m = [0, 0, 0]
[attitude]
kind = "fixed"
yaw_deg = 10
pitch_deg = 20
roll_deg = 30
spin_hz = 1
lever_arm_m = [0.1, 0, 0]
boresight = [0, 0, -1]
"#;

pub const LIMITS: &str = r#"marginal_share = 0.1
[position.horizontal_p95_m]
max = 1.5
[satellites.used]
min = 8
max = 40
[fidelity]
equals = "balanced"
"#;

pub const STUDY: &str = r#"name = "study"
title = "Jitter"
about = "Of the phase loop."
level = "correlator"
seed = 7
repetitions = 3
keep = ["phase_sigma_deg"]
[signal]
name = "GPS L1 C/A"
cn0_dbhz = 45
bandwidth_hz = 20e6
oscillator = "tcxo"
[motion]
doppler_hz = 10
acceleration_g = 1
jerk_g_per_s = 1
jerk_s = 2
[loop]
mode = "phase"
detectors = true
[measure]
settle_s = 5
duration_s = 60
[receiver.tracking]
pll_order = 3
pll_bandwidth_hz = 15
integration = 4
[[axis]]
key = "signal.cn0_dbhz"
from = 30
to = 50
count = 3
spacing = "linear"
label = "C/N0 (dB-Hz)"
[[plot]]
kind = "curve"
title = "Jitter"
x = "signal.cn0_dbhz"
y = "phase_sigma_deg"
log_y = true
"#;
