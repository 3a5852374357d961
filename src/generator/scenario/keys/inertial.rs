//! Keys of `[imu]`.

use crate::scenario::schema::{Key, number, numbers, word};

/// Grades of inertial sensors, each with its angle random walk in deg/√h, velocity random walk in m/s/√h and
/// bias instability of the gyroscopes in deg/h.
pub(crate) const GRADES: [(&str, [f64; 3]); 4] = [
    ("none", [0.0, 0.0, 0.0]),
    ("low", [0.75, 0.05, 10.0]),
    ("mid", [0.25, 0.03, 3.5]),
    ("tactical", [2e-3, 2.5e-5, 0.1]),
];

const OF_THE_GRADE: &str = "the grade's";
const ZEROS: &str = "[0, 0, 0]";

pub(crate) const IMU: &[Key] = &[
    number("rate_hz", 50.0, 1000.0, "Hz", "measurements per second").required(),
    numbers("lever_arm_m", 3, (-1e3, 1e3), "m", "vector from the moving point to the sensors: forward, right, down")
        .or_else(ZEROS),
    word(
        "grade",
        || GRADES.map(|(name, _)| name).to_vec(),
        "grade, which sets both random walks and the bias instability of the gyroscopes; none has no errors",
    )
    .or_else("none"),
    number("angle_random_walk_deg_per_sqrt_h", 0.0, 100.0, "deg/sqrt(h)", "white noise of the gyroscopes, integrated")
        .or_else(OF_THE_GRADE),
    number(
        "velocity_random_walk_mps_per_sqrt_h",
        0.0,
        100.0,
        "m/s/sqrt(h)",
        "white noise of the accelerometers, integrated",
    )
    .or_else(OF_THE_GRADE),
    number(
        "gyro_bias_instability_deg_per_h",
        0.0,
        1e4,
        "deg/h",
        "1/f noise of the gyroscopes: B of IEEE Std 952, 1.51 times the floor of their Allan deviation",
    )
    .or_else(OF_THE_GRADE),
    number(
        "accelerometer_bias_instability_mps2",
        0.0,
        1.0,
        "m/s2",
        "1/f noise of the accelerometers, in the same measure",
    )
    .or(0.0),
    number("rate_random_walk_deg_per_h_per_sqrt_h", 0.0, 1e4, "deg/h/sqrt(h)", "random walk of the gyroscopes' biases")
        .or(0.0),
    number(
        "acceleration_random_walk_mps2_per_sqrt_h",
        0.0,
        1.0,
        "m/s2/sqrt(h)",
        "random walk of the accelerometers' biases",
    )
    .or(0.0),
    numbers("gyro_bias_deg_per_h", 3, (-1e5, 1e5), "deg/h", "constant biases about forward, right, down")
        .or_else(ZEROS),
    numbers("accelerometer_bias_mps2", 3, (-10.0, 10.0), "m/s2", "constant biases along forward, right, down")
        .or_else(ZEROS),
    numbers("gyro_scale_factor_ppm", 3, (-1e5, 1e5), "ppm", "errors of the gyroscopes' scale factors").or_else(ZEROS),
    numbers("accelerometer_scale_factor_ppm", 3, (-1e5, 1e5), "ppm", "errors of the accelerometers' scale factors")
        .or_else(ZEROS),
    numbers(
        "gyro_misalignment_mrad",
        3,
        (-100.0, 100.0),
        "mrad",
        "rotation of the gyroscopes' axes about forward, right, down",
    )
    .or_else(ZEROS),
    numbers(
        "accelerometer_misalignment_mrad",
        3,
        (-100.0, 100.0),
        "mrad",
        "rotation of the accelerometers' axes about forward, right, down",
    )
    .or_else(ZEROS),
    numbers(
        "g_sensitivity_deg_per_h_per_g",
        3,
        (-1e4, 1e4),
        "deg/h/g",
        "error of each gyroscope by the specific force along its axis; g is 9.80665 m/s2",
    )
    .or_else(ZEROS),
];
