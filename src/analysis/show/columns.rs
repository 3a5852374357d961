//! Columns of tables that may have no rows; the rows themselves name the same ones.

/// `clock.csv`.
pub const CLOCK: &str = "sample,time_s,estimate_s,truth_s,error_s,detrended_s";
/// `allan.csv`.
pub const ALLAN: &str = "series,deviation,tau_s,value,low,high,terms,alpha,freedom";
/// `consistency.csv`.
pub const CONSISTENCY: &str = "sample,time_s,east_m,north_m,up_m,sigma_east_m,sigma_north_m,sigma_up_m,nees";
/// `protection.csv`.
pub const PROTECTION: &str = "sample,time_s,horizontal_m,vertical_m,hpl_m,vpl_m,available,detected";
/// Judge's `detection.csv`.
pub const DETECTION: &str = "sample,time_s,detector,sv,signal,statistic,threshold,alarm,label";
/// `detection_labelled.csv`.
pub const LABELLED: &str = "\
    sample,time_s,sv,signal,updates,cn0_dbhz,phase_lock,prompt,prompt_sigma,prompt_q,early,late,early_q,late_q,\
    early_sigma,late_sigma,tap_spacing_chips,dll_discriminator_chips,dll_sigma_chips,pll_sigma_cycles,level,cn0_fall,\
    correlation_ratio,correlation_phase,correlation_delta,code_carrier,raim,position_jump,clock_jump,directions,\
    label,attack";
/// `roc.csv`.
pub const ROC: &str = "detector,threshold_ratio,false_alarm_share,detection_share";
/// `position.csv`.
pub const POSITION: &str = "\
    sample,time_s,east_m,north_m,up_m,clock_m,velocity_east_mps,velocity_north_mps,velocity_up_mps,\
    sigma_east_m,sigma_north_m,sigma_up_m,sigma_clock_m,hdop,vdop,satellites";
/// `satellites.csv`.
pub const SATELLITES: &str = "\
    sv,signal,observations,elevation_mean_deg,code_mean_m,code_sigma_m,carrier_sigma_cycles,\
    doppler_mean_hz,doppler_sigma_hz,cn0_bias_db,cn0_sigma_db,multipath_rms_m";
/// `elevation.csv`.
pub const ELEVATION: &str = "\
    from_deg,to_deg,observations,code_rms_m,code_p95_m,carrier_rms_cycles,doppler_rms_hz,\
    cn0_bias_db,multipath_rms_m";
/// `jitter.csv`.
pub const JITTER: &str = "\
    sv,signal,loop,unit,cn0_dbhz,integration_s,raw_sigma,raw_theory_sigma,values,independent,mean,\
    sigma,sigma_interval,thermal_theory_sigma,oscillator_theory_sigma,stress_rms,stress_max,\
    theory_sigma,sigma_over_theory,threshold,margin,rule,rule_limit,holds,normality_p,sigma_m";
/// `errors.csv`.
pub const ERRORS: &str = "\
    sample,time_s,sv,signal,code_m,carrier_cycles,doppler_hz,cn0_dbhz,cn0_true_dbhz,\
    cn0_effective_dbhz,locked_s";
/// `foreign_slips.csv`.
pub const FOREIGN_SLIPS: &str = "label_s,sv,size_cycles,declared";
