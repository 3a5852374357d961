//! Legal numbers by physics and by the meaning of a key, key by key. This oracle does not know the product's
//! ranges.

/// Legality of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Legal {
    Yes,
    No,
    /// Value with a meaning, but beyond this program's promises, or legal only beside certain other values.
    Perhaps,
}

use Legal::{No, Perhaps, Yes};

/// Table, keys, and whether they may be 0 and −7. A table's name is as scenes write it.
type Row = (&'static str, &'static str, Legal, Legal);

/// Numbers with a fraction, in the unit of the key's name.
#[rustfmt::skip]
const NUMBERS: &[Row] = &[
    // Time passes; nothing comes before its beginning.
    ("", "duration_s", No, No),
    ("truth", "interval_s", No, No),
    ("satellites", "mask_deg", Yes, Yes),
    ("navigation", "galileo_ahead_ns", Yes, Yes),
    ("orbits", "antenna_offset_m", Yes, No),
    ("motion", "latitude_deg longitude_deg height_m azimuth_deg", Yes, Yes),
    ("motion", "node_longitude_deg argument_of_perigee_deg mean_anomaly_deg", Yes, Yes),
    ("motion", "semi_major_axis_m", No, No),
    // A circle; 0 to 180 degrees; from the ground up; no drag.
    ("motion", "eccentricity inclination_deg elevation_deg ignition_s drag_m2pkg", Yes, No),
    ("motion", "thrust_mps2 burn_s jerk_mps3 acceleration_mps2 turn_acceleration_mps2 turn_radius_m max_gap_s", No, No),
    ("motion.point", "latitude_deg longitude_deg height_m", Yes, Yes),
    ("motion.point", "speed_mps hold_s", Yes, No),
    ("attitude", "yaw_deg pitch_deg roll_deg spin_hz", Yes, Yes),
    ("front_end", "sample_rate_hz noise_lsb center_hz", No, No),
    // Real samples have no negative frequencies.
    ("front_end", "if_hz", Perhaps, Perhaps),
    ("power", "cn0_dbhz", Yes, Perhaps),
    ("power", "transmit_dbw loss_db", Yes, Yes),
    // A noise factor is at least one.
    ("power", "noise_figure_db", Yes, No),
    ("multipath", "amplitude excess_m height_m", Yes, No),
    ("multipath", "rate_mps phase_deg azimuth_deg", Yes, Yes),
    ("multipath", "distance_m", No, No),
    // Vacuum reflects nothing, and no material is thinner.
    ("city", "radius_m permittivity", No, No),
    ("city", "conductivity_spm cross_polar_db", Yes, No),
    ("city", "latitude_deg longitude_deg height_m", Yes, Yes),
    ("ionosphere", "vtec_tecu", Yes, No),
    ("ionosphere", "shell_km", No, No),
    ("troposphere", "height_m temperature_c", Yes, Yes),
    ("troposphere", "pressure_hpa", No, No),
    ("troposphere", "relative_humidity", Yes, No),
    ("obstruction", "loss_db", Yes, No),
    ("obstruction", "top_m roof_deg from_deg to_deg", Yes, Yes),
    ("obstruction", "edge_deg", No, No),
    ("scintillation", "s4", Yes, No),
    // Not without the phase that comes with the amplitude.
    ("scintillation", "sigma_phi_rad", Perhaps, No),
    ("scintillation", "decorrelation_s", No, No),
    ("receiver_clock", "bias_s", Yes, Perhaps),
    // A clock that ran backwards.
    ("receiver_clock", "drift_sps ageing_per_day sensitivity_per_g", Yes, No),
    ("playback", "load_sigma", No, No),
    ("playback", "attenuation_db", Yes, No),
    ("local_oscillator", "offset_hz", Yes, Yes),
    ("local_oscillator", "phase_noise_rad", Yes, No),
    ("local_oscillator", "phase_noise_bandwidth_hz", No, No),
    ("filter", "bandwidth_hz", No, No),
    ("iq", "gain_db", Yes, Perhaps),
    ("iq", "phase_deg dc_i_lsb dc_q_lsb", Yes, Yes),
    ("adc", "step_sigma agc_window_s", No, No),
    ("interference", "offset_hz js_db power_dbw eirp_dbw sweep_hz latitude_deg longitude_deg height_m", Yes, Yes),
    ("interference", "on_s deviation_hz jitter", Yes, No),
    ("interference", "off_s sweep_s rate_hz width_s bandwidth_hz sample_rate_hz", No, No),
    ("spoofer", "power_db power_start_db", Yes, Yes),
    ("spoofer", "on_s", Yes, No),
    ("spoofer", "ramp_s off_s", No, No),
    ("spoofer", "clock_bias_s", Yes, Perhaps),
    ("spoofer", "clock_drift_sps", Yes, No),
    ("spoofer.transmitter", "latitude_deg longitude_deg height_m", Yes, Yes),
    ("spoofer.drag", "start_s", Yes, No),
    ("spoofer.drag", "azimuth_deg elevation_deg", Yes, Yes),
    ("spoofer.drag", "speed_mps acceleration_mps2", No, No),
    ("fidelity", "knot_tolerance_cycles", No, No),
    // Intervals do not overlap, and end after they begin.
    ("expect.interval", "from_s to_s", Perhaps, No),
    ("expect", "position_within_m", No, No),
    ("expect.interval", "position_within_m", No, No),
    ("satellite_fault", "step_s", Yes, Perhaps),
    ("satellite_fault", "drift_sps on_s", Yes, No),
    ("satellite_fault", "radial_m along_m cross_m", Yes, Yes),
    ("satellite_fault", "ramp_s off_s", No, No),
    ("message_fault", "rate on_s", Yes, No),
    ("message_fault", "off_s", No, No),
    ("message_fault", "add", Yes, Yes),
    // The receiver's settings.
    ("acquisition", "doppler_max_hz", Yes, No),
    ("acquisition", "doppler_step_cycles cells_per_chip false_alarm_probability", No, No),
    ("tracking", "pll_bandwidth_hz fll_bandwidth_hz dll_bandwidth_hz dll_pull_in_bandwidth_hz spacing_chips \
                  fll_pull_in_s phase_lock_threshold loss_s pull_in_limit_s cn0_average_s", No, No),
    ("tracking", "fll_assist_bandwidth_hz dll_pull_in_s phase_unlock_threshold cn0_threshold_dbhz", Yes, No),
    ("position", "mask_deg smoothing_s ionosphere_wait_s ionosphere_error_share", Yes, No),
    ("position", "false_alarm model_sigma_m", No, No),
    // No fault, no bias, no error of a satellite; a level needs a limit and a promise.
    ("integrity", "sigma_ura_m sigma_ure_m b_nom_m p_sat p_const p_emt", Yes, No),
    ("integrity", "phmi_vertical phmi_horizontal false_alarm_vertical false_alarm_horizontal p_threshold", No, No),
    ("integrity", "missed_detection hal_m val_m emt_limit_m sigma_v_acc_limit_m", No, No),
    ("detection", "false_alarm interval_s reference_s", No, No),
    ("array", "block_ms", No, No),
    ("array", "loading_db azimuth_deg elevation_deg", Yes, Yes),
    ("array", "phase_sigma_deg", Yes, No),
    ("imu", "rate_hz", No, No),
    ("imu", "accelerometer_bias_instability_mps2", Yes, No),
    ("array.element", "gain_db phase_deg delay_ns", Yes, Yes),
    ("operation", "search_interval_s reacquisition_interval_s repeated_false_alarm_share frame_limit_s", No, No),
    // A study's own tables; a scene has none of these names.
    ("measure", "settle_s", Yes, No),
];

/// The rest of a study's.
#[rustfmt::skip]
const STUDIES: &[Row] = &[
    ("measure", "duration_s", No, No),
    ("signal", "cn0_dbhz", Yes, Perhaps),
    ("signal", "bandwidth_hz", No, No),
    ("motion", "doppler_hz acceleration_g jerk_g_per_s", Yes, Yes),
    ("motion", "jerk_s", No, No),
    ("plot", "level", Yes, Yes),
    // On a logarithm's way neither.
    ("axis", "from to", Perhaps, Perhaps),
    ("axis", "step", No, Perhaps),
];

/// Whole numbers: −0.0 is none.
const WHOLE: &[Row] = &[
    ("array", "attitude_ms", Yes, No),
    ("", "seed", Yes, No),
    ("", "repetitions", No, No),
    ("axis", "count", No, No),
    ("playback adc", "bits", No, No),
    ("filter", "order", No, No),
    ("city", "order", Yes, No),
    ("message_fault", "subframe word bit", No, No),
    ("message_fault", "health", Yes, No),
    ("acquisition tracking", "coherent_periods noncoherent_sums pll_order fll_order dll_order integration", No, No),
    ("operation", "measurement_interval_ms tracking_interval_ms", No, No),
];

/// Texts that any words may be: of a path, of a title.
const PATHS: [&str; 10] =
    ["file", "sp3", "antenna_file", "gpt3_file", "vmf_file", "scenario", "title", "about", "label", "reason"];

/// Keys whose bound may be any finite number.
const BOUNDS: [&str; 2] = ["min", "max"];

/// Legality of `bad` at `table.key`, where `was` is the present value; `None` if the tables do not know the
/// key.
pub fn legal(table: &str, key: &str, was: &str, bad: &str) -> Option<Legal> {
    let table = table.trim_start_matches("receiver.").trim_start_matches("station.").trim_start_matches("front_end.");
    let last = key.rsplit('.').next().unwrap_or(key);
    if last == "equals" {
        return Some(if ["inf", "-inf", "nan", "[1979-05-27]"].contains(&bad) { No } else { Yes });
    }
    // Another axis by that name may be what the values of this one need. The file of a signal is read with
    // the scene that names it.
    if ["zip", "signal_file"].contains(&last) && bad == "\"5 m\"" {
        return Some(Perhaps);
    }
    let is_number = was.parse::<f64>().is_ok();
    if !is_number {
        let fits = match bad {
            "true" => was == "true" || was == "false",
            "\"5 m\"" => was.starts_with('"') && PATHS.contains(&last),
            _ => false,
        };
        return Some(if fits { Yes } else { No });
    }
    if !["0", "-0.0", "-7"].contains(&bad) {
        return Some(if bad == "1e308" && BOUNDS.contains(&last) { Perhaps } else { No });
    }
    if BOUNDS.contains(&last) {
        // Not above the other bound.
        return Some(Perhaps);
    }
    if last == "marginal_share" {
        return Some(if bad == "-7" { No } else { Yes });
    }
    let has = |row: &&Row| row.0.split(' ').any(|name| name == table) && row.1.split(' ').any(|name| name == last);
    if let Some((.., zero, seven)) = WHOLE.iter().find(has) {
        return Some(match bad {
            "0" => *zero,
            "-7" => *seven,
            _ => No,
        });
    }
    let (.., zero, seven) = NUMBERS.iter().chain(STUDIES).find(has)?;
    Some(if bad == "-7" { *seven } else { *zero })
}
