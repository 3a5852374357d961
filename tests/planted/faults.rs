//! The list of all planted faults: what is wrong, and which test of this target must fail.

/// One fault.
pub struct Fault {
    /// Name as in `planted!`: world, place, fault.
    pub name: &'static str,
    pub what: &'static str,
    /// The path of a test in this target.
    pub check: &'static str,
}

const CODES: &str = "witness::codes::all_chips_of_all_codes_are_those_of_another_program";
const PARITY: &str = "witness::printed::a_word_s_parity_is_the_printed_one_and_one_wrong_bit_breaks_it";
const FIELDS: &str = "witness::printed::every_field_of_the_message_has_the_printed_position_sign_and_scale";
const INAV: &str = "witness::printed::every_field_of_i_nav_has_the_printed_position_sign_and_scale";
const CODED: &str = "witness::printed::pages_of_i_nav_are_checked_coded_interleaved_and_timed_as_printed";
const BEIDOU: &str = "witness::beidou::real_subframes_keep_their_parities_and_come_back_through_our_interleaving";
const BEIDOU_CODES: &str = "witness::beidou::all_chips_of_all_codes_are_those_of_another_program";
const BEIDOU_SETS: &str = "witness::beidou::real_sets_are_the_records_of_a_converter_and_are_sent_by_us_bit_by_bit";
const BEIDOU_GEO: &str = "witness::beidou::a_real_geostationary_satellite_stands_over_the_equator";
const BEIDOU_DELAY: &str = "witness::beidou::delays_by_geographic_latitude_are_those_of_another_program";
const GLONASS_CODE: &str =
    "witness::glonass::all_chips_of_the_code_are_those_of_another_program_and_all_satellites_have_it";
const GLONASS_CHANNELS: &str = "witness::glonass::carriers_are_the_printed_ones_and_channels_those_of_real_records";
const GLONASS_FIELDS: &str = "witness::glonass::every_field_of_the_strings_has_the_printed_position_sign_and_scale";
const GLONASS_STRINGS: &str =
    "witness::glonass::real_strings_keep_their_checks_through_our_coding_and_no_wrong_bit_passes";
const GLONASS_SETS: &str = "witness::glonass::real_sets_are_the_records_of_a_converter_and_say_their_time_and_sender";
const GLONASS_SENT: &str = "witness::glonass::strings_that_we_send_of_a_real_set_have_the_real_bits";
const GLONASS_NEIGHBOURS: &str = "witness::glonass::neighbouring_sets_meet_half_way_to_what_uploads_step_by";
const GLONASS_ORBITS: &str = "witness::glonass::broadcast_orbits_meet_those_of_code_and_clocks_too";
const NAVIC: &str = "witness::navic::subframes_are_coded_interleaved_and_timed_as_printed";
const NAVIC_CODES: &str = "witness::navic::all_chips_of_all_codes_are_those_of_another_program";
const NAVIC_L1_CODES: &str =
    "witness::navic_l1::all_chips_of_all_codes_and_secondary_codes_of_l1_are_those_of_another_program";
const NAVIC_L1_COUNT: &str =
    "witness::navic_l1::frames_are_counted_to_their_end_from_1_to_400_in_the_two_hours_in_which_they_begin";
const NAVIC_L1_CARRIED: &str =
    "witness::navic_l1::a_set_of_the_older_message_carried_to_l1_nav_is_the_same_orbit_and_clock_to_its_steps";
const NAVIC_READ: &str = "witness::navic::a_stream_is_read_from_any_symbol_inverted_or_not_to_what_was_sent";
const REDUNDANT: &str = "witness::redundancy::real_words_17_to_20_are_the_redundancy_of_the_real_words_1_to_4";
const SHORT: &str = "witness::reduced::elements_in_short_of_the_embedded_file_are_as_good_as_real_ones";
const DELAYS: &str = "witness::printed::clocks_of_single_signals_are_behind_by_the_group_delays_that_documents_print";
const SBAS_SETS: &str =
    "witness::sbas::shipped_sets_are_whole_steps_of_the_fields_and_are_read_again_from_any_symbol_inverted_or_not";
const PEAK: &str = "judge::a_correlation_peak_lies_at_the_delay_of_its_ray";
const SBAS_MASK: &str = "witness::sbas::blocks_of_a_mask_and_of_ageing_are_the_printed_ones";
const SBAS_GRID: &str = "witness::sbas::points_of_printed_masks_of_the_grid_lie_where_the_bands_have_them";
const QZSS_CODES: &str = "witness::codes::all_chips_of_all_codes_are_those_of_another_program";
const QZSS_PRN: &str =
    "witness::codes::satellites_of_qzss_have_the_codes_of_the_prn_that_rinex_names_and_those_of_gps_do_not";
const QZSS_HEALTH: &str =
    "witness::qzss::satellites_with_l1c_b_say_that_l1_c_a_is_not_to_be_used_and_others_that_it_is";
const QZSS_SENDERS: &str = "witness::qzss::satellites_send_the_signals_that_they_broadcast";
const QZSS_CNAV: &str =
    "witness::qzss::every_real_message_of_l5_and_l2c_is_read_and_sent_again_and_its_sets_are_the_records_of_the_hour";
const B1C_CODES: &str =
    "witness::bcnav1::all_chips_of_all_codes_and_secondary_codes_of_b1c_are_those_of_another_program";
const FRAMES_B1C: &str = "witness::bcnav1::frames_are_read_from_any_symbol_inverted_or_not_to_what_was_sent";
const BDGIM: &str = "witness::bdgim::positions_and_contents_are_those_of_the_authors_program";
const BDGIM_FIELDS: &str = "witness::bdgim::coefficients_have_their_positions_signs_and_steps_in_all_three_messages";
const FIELD_64: &str = "witness::bcnav1::elements_of_six_bits_are_those_of_the_printed_field";
const B2_CODES: &str =
    "witness::bcnav2::all_chips_of_all_codes_and_secondary_codes_of_b2a_and_b2b_are_those_of_another_program";
const MESSAGES_B2: &str = "witness::bcnav2::messages_are_read_from_any_symbol_inverted_or_not_to_what_was_sent";
const PRINTED_B2: &str =
    "witness::bcnav2::messages_that_a_receiver_printed_are_what_it_decoded_and_are_framed_by_us_as_it_printed_them";
const MIXED_B2: &str =
    "witness::bcnav2::a_set_that_follows_another_is_never_mixed_with_it_wherever_reading_begins_or_fails";
const CARRIED_B2: &str =
    "witness::bcnav2::a_set_of_d1_carried_to_b_cnav2_and_b_cnav3_is_the_same_orbit_and_clock_to_its_steps";
const UTC_B2: &str =
    "witness::bcnav2::utc_is_four_seconds_behind_bdt_since_2017_and_real_polynomials_are_whole_steps_of_the_fields";
const L1C_CODES: &str =
    "witness::codes::all_chips_of_all_codes_and_secondary_codes_of_l1c_are_those_of_another_program";
const FRAMES_L1C: &str =
    "witness::cnav2::shipped_frames_are_coded_again_symbol_by_symbol_read_inverted_or_not_and_sent_again";
const CIVIL: &str = "witness::cnav::shipped_messages_of_l5_and_l2c_hold_and_are_sent_by_us_bit_by_bit";
const WRITTEN: &str = "witness::cnav::shipped_sets_are_written_in_the_numbers_of_another_converter";
const CARRIED: &str = "witness::cnav::a_set_of_lnav_carried_to_cnav_is_the_same_orbit_and_clock_to_its_steps";
const L2C_CODES: &str = "witness::codes::all_chips_of_all_codes_of_l2c_are_those_of_another_program_and_take_turns";
const L5_CODES: &str = "witness::codes::all_chips_of_all_codes_of_l5_are_those_of_another_program";
const E5_PAGES: &str = "witness::fnav::shipped_pages_of_e5a_and_e5b_hold_and_are_sent_by_us_bit_by_bit";
const ALTBOC: &str = "witness::altboc::the_waveform_of_e5_is_what_the_table_of_phases_has_of_its_four_codes";
const SIDES: &str = "sides::both_sides_of_a_sub_carrier_are_followed_on_the_peak_that_they_make_together";
const E6_CODES: &str = "witness::codes::all_chips_of_all_codes_of_e6_are_those_of_another_program";
const E6_PAGES: &str = "witness::galileo_e6::pages_of_e6_are_coded_and_interleaved_as_printed";
const E6_TIME: &str =
    "witness::galileo_e6::pages_of_e6_are_read_from_any_symbol_and_another_signal_tells_which_second_they_are_of";
const E5_CODES: &str = "witness::codes::all_chips_of_all_codes_and_secondary_codes_of_e5_are_those_of_another_program";
const TWO_BANDS: &str =
    "laws::two_bands_show_the_ionosphere_without_the_group_delays_of_the_message_and_give_a_position_without_it";
const CLOCKS: &str = "laws::two_systems_whose_times_differ_give_one_position_and_a_clock_of_each";
const OUTER: &str = "laws::a_loop_of_two_pairs_reads_a_small_error_as_it_is";
const SUMS: &str = "laws::running_sums_give_what_every_sample_by_itself_does";
const LAYERS: &str = "bands::composite_chips_have_a_tenth_as_much_power_in_the_quick_layer_as_in_the_slow_one";
const NO_L1: &str = "bands::two_bands_neither_of_which_is_l1_show_the_ionosphere_on_l1_and_how_well";
const COMBINED: &str =
    "bands::a_combination_is_as_old_as_its_younger_carrier_and_may_jump_by_as_much_more_as_it_is_noisier";
const SHARE: &str = "bands::half_of_the_power_is_as_noisy_as_a_signal_of_half_the_power";
const WRITTEN_OBS: &str = "bands::observation_files_count_satellites_flag_slips_and_name_channels";
const FDMA: &str = "channels::codes_of_glonass_are_aided_by_the_carriers_of_their_own_channels";
const OFFSET: &str = "laws::with_the_broadcast_offset_any_four_satellites_of_two_systems_give_position_and_time";
const PAGES: &str =
    "witness::printed::the_page_with_the_ionosphere_and_the_count_of_the_handover_are_where_they_are_printed";
const TIMES: &str = "witness::printed::weeks_begin_on_sunday_and_leap_seconds_are_those_of_the_bulletins";
const PACKED: &str = "witness::packed::codes_and_their_positions_are_those_that_makers_print";
const BANDS: &str = "witness::packed::bands_of_one_oscillator_have_its_frequency_at_zero";
const PLACES: &str = "witness::printed::positions_and_directions_are_the_published_ones";
const GRAVITY: &str = "witness::printed::gravity_is_that_of_the_ellipsoid_once_the_term_of_degree_four_is_added";
const INERTIAL: &str = "inertial::measurements_without_errors_come_back_within_a_millimetre_in_a_minute";
const ORBITS: &str = "witness::orbit::broadcast_orbits_of_2010_meet_the_igs_final_ones";
const STATIONS: &str = "witness::pseudorange::two_japanese_stations_fit_the_model";
const KLOB: &str = "witness::atmosphere::klobuchar_gives_the_worked_value_of_rtklib";
const SAAS: &str = "witness::atmosphere::saastamoinen_gives_the_worked_value_of_rtklib";
const INTEGERS: &str = "baselines::published_float_vectors_have_the_published_integers_and_norms";
const SUCCESS: &str = "baselines::one_ambiguity_is_rounded_right_as_often_as_a_normal_number_is_within_half_a_cycle";
const BASELINE: &str = "baselines::true_observations_of_two_stations_give_the_true_baseline_and_the_true_integers";
const BROKEN: &str =
    "baselines::a_broken_count_of_the_rover_is_heeded_where_there_is_a_position_and_where_there_is_none";
const RTCM_PRINTED: &str = "rtcm::the_printed_station_has_the_printed_check";
const RTCM_OBSERVED: &str = "rtcm::real_messages_of_one_epoch_agree_in_time_and_in_code_and_carrier";
const RTCM_LOCK: &str = "rtcm::lock_times_are_those_of_the_printed_table";
const RTCM_ORBITS: &str = "rtcm::real_ephemerides_are_orbits_of_their_systems";
pub const LOOP: &str = "loops::a_short_ride_under_an_open_sky_keeps_every_limit";
const ARRAY_SPOOFED: &str = "arrays::a_spoofer_reaches_the_elements_from_its_own_direction";
const ARRAY_ATTITUDE: &str = "arrays::an_attitude_is_that_of_the_body_whose_elements_were_turned";
const ARRAY: &str = "arrays::satellites_reach_the_elements_with_the_phases_by_which_the_receiver_steers";
const EXACT: &str = "laws::exact_ranges_give_the_exact_position_velocity_and_clock";
const COV: &str = "laws::the_covariance_is_the_inverse_of_the_weighted_geometry";
const RAIM: &str = "laws::a_range_that_is_wrong_by_twenty_metres_is_excluded_and_no_other";
const SMOOTH: &str = "laws::smoothing_leaves_the_variance_that_it_states";
const RAYS: &str = "laws::the_ionosphere_delays_code_by_what_it_advances_the_carrier_and_air_delays_both";
const FRIIS: &str = "laws::the_link_budget_loses_power_as_friis_says";
const CLOCK: &str = "laws::a_clock_s_drift_is_the_one_that_it_was_given";
const LOCK: &str = "laws::noise_shows_no_phase_lock_and_a_steady_phase_does";
const ADC: &str = "laws::a_two_bit_converter_has_its_levels_a_step_apart";
const STAT: &str = "laws::statistics_are_those_of_their_definitions";
const JIT: &str = "laws::jitter_is_kaplan_and_hegarty_s";
const JPOS: &str = "judge::figures_of_the_position_are_those_of_its_rows";
const JOBS: &str = "judge::figures_of_the_observations_are_those_of_their_rows";
const JDAM: &str = "judge::damaged_tables_fail_by_the_row_that_names_the_damage";
const JSPEC: &str = "judge::the_spectrum_of_faultless_samples_keeps_its_limits";
const SHARES: &str = "bands::what_edges_take_from_a_component_is_not_put_back";
const POLES: &str = "laws::a_butterworth_filter_passes_half_of_the_power_at_the_edges_of_its_band";
const TAGS: &str = "witness::osnma::every_tag_of_august_is_right_from_the_public_key_on";
const LATE: &str = "witness::osnma::of_a_recording_that_is_replayed_a_minute_later_only_tags_of_the_slow_mac_are_right";
const ARAIM: &str = "witness::protection::the_worked_example_of_araim_has_its_printed_levels";
const LEVELS: &str = "witness::protection::levels_of_sbas_are_the_printed_factors_times_the_printed_axes";
const ALARMS: &str = "witness::detection::thresholds_are_those_that_tables_print_for_both_sides";
const AMONG: &str =
    "witness::detection::a_number_among_six_others_is_beyond_the_normal_bound_where_the_printed_one_of_student_is";
const LABELS: &str = "judge::alarms_in_the_seconds_of_a_jammer_are_detections_and_none_of_them_is_false";
const JALL: &str = "judge::deviations_of_a_clock_are_those_that_sp_1065_prints";

const fn fault(name: &'static str, what: &'static str, check: &'static str) -> Fault {
    Fault { name, what, check }
}

/// List of all faults, by world.
#[rustfmt::skip]
pub const FAULTS: &[Fault] = &[
    fault("gnss.code.g2_taps", "one feedback tap of G2 is missing", CODES),
    fault("gnss.code.g2_delay", "the code of PRN 32 is a chip late", CODES),
    fault("gnss.code.chips_beyond_512", "every code is wrong from its 513th chip on", CODES),
    fault("gnss.lnav.parity_mask", "D7 is missing in all parity equations", PARITY),
    fault("gnss.lnav.parity_star", "D29* and D30* are exchanged in the parity", PARITY),
    fault("gnss.lnav.parity_unchecked", "words with wrong parity are accepted", PARITY),
    fault("gnss.lnav.scale_crs", "the scale of C_rs is 2^-4, sent and read", FIELDS),
    fault("gnss.lnav.scale_af1", "the scale of a_f1 is 2^-42, sent and read", FIELDS),
    fault("gnss.lnav.scale_alpha", "the scale of alpha_2 is 2^-23, sent and read", FIELDS),
    fault("gnss.lnav.sign_tgd", "T_GD has no sign, sent and read", FIELDS),
    fault("gnss.lnav.idot_in_radians", "IDOT is read in radians in place of semicircles", FIELDS),
    fault("gnss.lnav.field_place", "C_uc begins a bit late, sent and read", FIELDS),
    fault("gnss.lnav.handover_count", "the handover word counts the subframe that it is in", PAGES),
    fault("gnss.lnav.page_order", "pages of subframes 4 and 5 come a frame early", PAGES),
    fault("gnss.inav.scale_af0", "the scale of a_f0 is 2^-33, sent and read", INAV),
    fault("gnss.inav.second_symbol", "the symbols of G2 are not inverted, sent and read", CODED),
    fault("gnss.inav.word_order", "words come a page early, sent and read", CODED),
    fault("gnss.inav.reduced_begin", "elements in short refer to the second before the sub-frame, sent and \
                                      read", SHORT),
    fault("gnss.beidou.g2_output", "the code of PRN 7 has another output", BEIDOU_CODES),
    fault("gnss.beidou.g1_reset", "the first register of B3I begins again a chip late", BEIDOU_CODES),
    fault("gnss.beidou.neuman_hofman", "the last chip of the Neuman-Hofman code is wrong, sent and read", BEIDOU_SETS),
    fault("gnss.beidou.bch", "the parity has another polynomial, sent and read", BEIDOU),
    fault("gnss.beidou.second_sent", "subframes say the second of the next one", BEIDOU_SETS),
    fault("gnss.beidou.second_read", "subframes are read as the ones after them", BEIDOU_SETS),
    fault("gnss.beidou.tilt", "the plane of geostationary orbits is tilted the other way", BEIDOU_GEO),
    fault("gnss.beidou.latitude", "the ionosphere's latitude has a sign", BEIDOU_DELAY),
    fault("gnss.navic.g2_start", "the code of PRN 7 begins elsewhere", NAVIC_CODES),
    fault("gnss.navic.carry", "the second register of L1's codes misses what adding carries", NAVIC_L1_CODES),
    fault("gnss.navic.l1_time", "the count of a frame of L1 is taken for its own beginning", NAVIC_L1_COUNT),
    fault("gnss.navic.isc", "the correction of L1 is taken off where it is added", NAVIC_L1_CARRIED),
    fault("gnss.navic.time_sent", "a subframe counts itself and not the next one", NAVIC),
    fault("gnss.navic.time_read", "a subframe is read as the one after it", NAVIC_READ),
    fault("gnss.fec.field", "the field of the Reed-Solomon code has another polynomial, sent and read", REDUNDANT),
    fault("gnss.fec.interleaver", "neighbouring symbols are exchanged", CODED),
    fault("gnss.crc.polynomial", "the check has another polynomial, sent and read", CODED),
    fault("gnss.glonass.output", "the code comes from the ninth stage", GLONASS_CODE),
    fault("gnss.signal.channel", "channels count downwards", GLONASS_CHANNELS),
    fault("gnss.bits.magnitude", "a magnitude with a sign is read as if less than its most", GLONASS_FIELDS),
    fault("gnss.glonass.hamming", "a check is missing, sent and read", GLONASS_STRINGS),
    fault("gnss.glonass.mark", "an inverted stream is taken for a normal one", GLONASS_SETS),
    fault("gnss.glonass.frame_sent", "frames say the time of the next one", GLONASS_SENT),
    fault("gnss.glonass.frame_read", "frames are read as the ones after them", GLONASS_SETS),
    fault("gnss.glonass.day", "days of four years count from 0", GLONASS_SETS),
    fault("gnss.glonass.tau_sent", "the clock is sent with its own sign", GLONASS_SENT),
    fault("gnss.glonass.tau_read", "the clock is read with the sign that is sent", GLONASS_SETS),
    fault("gnss.glonass.delta_tau", "G2 leaves the antenna before G1", DELAYS),
    fault("gnss.glonass.gamma", "the clock's rate with the wrong sign, on both sides", DELAYS),
    fault("gnss.glonass.rotation", "the axes of a state vector turn the other way, on both sides", GLONASS_ORBITS),
    fault("gnss.glonass.zonal", "state vectors move about a round Earth, on both sides", GLONASS_ORBITS),
    fault("gnss.glonass.pull", "Moon and Sun push, on both sides", GLONASS_NEIGHBOURS),
    fault("gnss.time.scale_leaps", "a time with leap seconds has none", GLONASS_SETS),
    fault("gnss.orbit.crs", "C_rs with the wrong sign, on both sides", ORBITS),
    fault("gnss.orbit.cus", "C_uc in place of C_us, on both sides", ORBITS),
    fault("gnss.orbit.idot", "the inclination has no rate, on both sides", ORBITS),
    fault("gnss.orbit.omega_dot", "the node has no rate of its own, on both sides", ORBITS),
    fault("gnss.orbit.delta_n", "the correction of the mean motion with the wrong sign, on both sides", ORBITS),
    fault("gnss.orbit.true_anomaly", "the true anomaly without the root of 1 - e^2, on both sides", ORBITS),
    fault("gnss.orbit.velocity", "the velocity without a term of the turning axes, on both sides", ORBITS),
    fault("gnss.clock.relativity", "the relativistic term with the wrong sign, on both sides", ORBITS),
    fault("gnss.clock.af1", "the clock polynomial with a wrong drift, on both sides", ORBITS),
    fault("gnss.clock.group_delay", "T_GD with the wrong sign, on both sides", STATIONS),
    fault("gnss.klobuchar.obliquity", "a constant of the slant factor is 0.50, on both sides", KLOB),
    fault("gnss.klobuchar.pole", "the geomagnetic pole at another longitude, on both sides", KLOB),
    fault("gnss.klobuchar.noon", "the bulge is highest at noon in place of 14 h, on both sides", KLOB),
    fault("gnss.gravity.oblateness", "the oblateness pulls the other way, on both sides", GRAVITY),
    fault("gnss.earth.rotation", "the Earth turns the other way during flight, on both sides", PLACES),
    fault("gnss.earth.height", "height is left out of z", PLACES),
    fault("gnss.earth.azimuth", "azimuth is counted from east over north", PLACES),
    fault("gnss.time.leap_seconds", "a leap second too many", TIMES),
    fault("gnss.time.week", "a week too many", TIMES),
    fault("gnss.packed.first", "packed samples begin at the other end of a byte", PACKED),
    fault("gnss.packed.order", "I and Q of packed samples are exchanged", PACKED),
    fault("gnss.packed.magnitude", "negative magnitudes are positive", PACKED),
    fault("gnss.packed.middle", "two's complement of a few bits lies below the middle of its step", PACKED),
    fault("gnss.ion.negated", "a negated quadrature part does not mirror the spectrum", BANDS),
    fault("osnma.tags.time", "tags count whenever they come", LATE),
    fault("osnma.chain.step", "a key is proved by one step too few", TAGS),
    fault("osnma.mac.satellite", "the first tag names the satellite of its data", TAGS),
    fault("osnma.data.issue", "tags cover the words of their own sub-frame", TAGS),
    fault("generator.sky.earth_rotation", "the Earth does not turn during flight", LOOP),
    fault("generator.sky.light_time", "the satellite is where it is on arrival, not where it was on sending", LOOP),
    fault("generator.sky.clock_sign", "satellite clocks with the wrong sign", LOOP),
    fault("generator.synth.delay", "code delays are 2e-7 of themselves too long", LOOP),
    fault("generator.array.phase", "phases of an array's channels with the wrong sign", ARRAY),
    fault("generator.spoof.path", "a spoofer reaches all elements at once", ARRAY_SPOOFED),
    fault("receiver.array.attitude", "elements nearer to a satellite hear it later", ARRAY_ATTITUDE),
    fault("receiver.array.steering", "an array steers to the other side", ARRAY),
    fault("generator.synth.carrier_phase", "the carrier is a tenth of a cycle ahead", LOOP),
    fault("generator.knots.change", "rates within a run are 1 % too high", LOOP),
    fault("generator.synth.doppler_sign", "Doppler of the samples with the wrong sign", LOOP),
    fault("generator.synth.amplitude", "signals are 0.5 dB too strong", LOOP),
    fault("generator.synth.code_phase", "codes are up to 4 ns late, by satellite", LOOP),
    fault("generator.synth.code_rate", "codes run 2e-5 too fast within a run", LOOP),
    fault("generator.synth.message_time", "data bits come a code period early", LOOP),
    fault("generator.synth.bit_order", "words are sent least significant bit first", LOOP),
    fault("generator.noise.level", "noise is 0.5 dB too strong", LOOP),
    fault("generator.noise.repeats", "noise repeats after two blocks", LOOP),
    fault("generator.converter.step", "the converter takes steps of twice the size", ADC),
    fault("generator.ionosphere.code", "the ionosphere delays codes by nine tenths", LOOP),
    fault("generator.ionosphere.carrier_sign", "the ionosphere delays the carrier", RAYS),
    fault("generator.troposphere.zenith", "the hydrostatic zenith delay is 2 % too long", SAAS),
    fault("generator.troposphere.carrier_sign", "the troposphere advances the carrier", RAYS),
    fault("generator.link.spreading", "free space takes 19.9 lg of the distance", FRIIS),
    fault("generator.clock.drift", "the clock drifts by a twentieth more", CLOCK),
    fault("generator.truth.doppler", "the truth has Doppler with the wrong sign", LOOP),
    fault("generator.truth.clock_in_carrier", "the carrier does not show the clock", LOOP),
    fault("generator.inertial.earth", "inertial sensors do not feel the Earth's rotation", INERTIAL),
    fault("receiver.acquire.code_phase", "the search hands over a code phase two chips off", LOOP),
    fault("receiver.loops.pll_bandwidth", "the phase loop is half as wide again", LOOP),
    fault("receiver.loops.dll_bandwidth", "the code loop is six times as wide", LOOP),
    fault("receiver.loops.costas_gain", "the phase discriminator is 1.4 times too steep", LOOP),
    fault("receiver.loops.code_gain", "the code discriminator is 1.5 times too steep", LOOP),
    fault("receiver.loops.outer", "the outer pair of a double delta is left out", OUTER),
    fault("receiver.loops.frequency_sign", "the frequency discriminator has the wrong sign", LOOP),
    fault("receiver.loops.step", "a loop update takes too little of what the half intervals bring", LOOP),
    fault("receiver.nco.carrier_aid", "the carrier aids the code with the wrong sign", LOOP),
    fault("receiver.nco.carrier_between_updates", "a measurement forgets the carrier since the last code period", LOOP),
    fault("receiver.rows.place", "the code is read from its table half a sample late", LOOP),
    fault("receiver.sums.place", "changes of the code's sign are met half a sample late", SUMS),
    fault("receiver.sums.window", "early and late are taken from the wrong sides", SUMS),
    fault("receiver.measure.doppler_sign", "Doppler with the wrong sign", LOOP),
    fault("receiver.measure.carrier_sign", "the carrier with the wrong sign", LOOP),
    fault("receiver.cn0.scale", "C/N0 reads 0.5 dB too high", LOOP),
    fault("receiver.lock.always", "phase lock always shows", LOCK),
    fault("receiver.symbol_sync", "symbols are cut a code period late", LOOP),
    fault("receiver.decode.bit_threshold", "bits are decided far from zero", LOOP),
    fault("gnss.lnav.handover_read", "the handover count is taken for the time of its own subframe", LOOP),
    fault("receiver.decode.polarity", "the half cycle is resolved the wrong way", LOOP),
    fault("receiver.observe.code_fraction", "the time sent is 3 ns late", LOOP),
    fault("receiver.position.earth_rotation", "the Earth does not turn during flight", EXACT),
    fault("receiver.position.system_offset", "the broadcast offset of a system's time with the wrong sign", OFFSET),
    fault("receiver.position.own_clock", "all systems' ranges count against one clock", CLOCKS),
    fault("receiver.position.clock_sign", "satellite clocks with the wrong sign", EXACT),
    fault("receiver.position.group_delay", "T_GD is left out", EXACT),
    fault("receiver.position.troposphere", "the troposphere is 1.02 of what it should be", EXACT),
    fault("receiver.position.ionosphere", "the ionosphere is nine tenths of what was sent", EXACT),
    fault("receiver.position.time_sign", "GPS time is the clock plus its bias", EXACT),
    fault("receiver.position.weight", "ranges weigh by their variance", COV),
    fault("receiver.position.model_sigma", "the models' sigma does not grow towards the horizon", COV),
    fault("receiver.position.sigma_x3", "position sigmas are three times as large", COV),
    fault("receiver.position.sigma_x05", "position sigmas are half as large", COV),
    fault("receiver.position.sigma_clock", "the clock's sigma is three times as large", COV),
    fault("receiver.position.correlation", "a correlation has the wrong sign", COV),
    fault("receiver.position.hdop", "HDOP is of east and up", COV),
    fault("receiver.raim.threshold", "the residual test forgives a hundred times as much", RAIM),
    fault("receiver.raim.choice", "the exclusion tries the least likely satellites first", RAIM),
    fault("receiver.araim.axis", "vertical separations have the factor of horizontal ones", ARAIM),
    fault("receiver.araim.ure", "separations have the deviations of integrity", ARAIM),
    fault("receiver.araim.bias", "the level forgets biases of the solutions without a satellite", ARAIM),
    fault("receiver.araim.constellations", "no constellation is ever faulty", ARAIM),
    fault("receiver.sbas.factor", "the vertical level of SBAS has the horizontal factor", LEVELS),
    fault("receiver.sbas.ellipse", "the error ellipse lies along east or north", LEVELS),
    fault("receiver.detect.threshold", "thresholds are those of twice the false alarms", ALARMS),
    fault("receiver.detect.mean", "the mean of a reference has no error", AMONG),
    fault("receiver.smooth.carrier_sign", "smoothing goes against the carrier", LOOP),
    fault("receiver.smooth.variance", "smoothing forgets that code errors are correlated", SMOOTH),
    fault("receiver.velocity.frame", "velocity forgets that the axes turn", EXACT),
    fault("receiver.velocity.satellite_drift", "velocity takes another drift for the satellites' clocks", EXACT),
    fault("receiver.velocity.drift_sign", "the clock's drift has the wrong sign", EXACT),
    fault("gnss.delay.second", "the group delay of B2I has the wrong sign", DELAYS),
    fault("gnss.delay.square", "group delays go with 1/f to other carriers", DELAYS),
    fault("gnss.l5.advance", "XB of L5 is a chip early", L5_CODES),
    fault("gnss.l2c.register", "the register of L2C feeds back into another stage", L2C_CODES),
    fault("gnss.l2c.turn", "CL is sent first, and CM second", L2C_CODES),
    fault("gnss.sbas.codes", "the code of PRN 131 is a chip late", QZSS_CODES),
    fault("gnss.sbas.place", "x of augmentation systems has the steps of z", SBAS_SETS),
    fault("gnss.sbas.accuracy", "satellites that range count as such that do not", SBAS_SETS),
    fault("gnss.sbas.tow", "blocks of type 12 are taken for the ones before", SBAS_SETS),
    fault("gnss.sbas.mask", "a mask names the satellites before those that it means", SBAS_MASK),
    fault("gnss.sbas.bands", "every second meridian of the grid lacks its points beyond 55 degrees", SBAS_GRID),
    fault("gnss.sbas.acceleration", "accelerations count twice", SBAS_SETS),
    fault("gnss.qzss.codes", "codes of QZSS but the first are a chip late", QZSS_CODES),
    fault("gnss.qzss.prn", "satellites of QZSS have the codes of the next", QZSS_PRN),
    fault("gnss.qzss.secondary_code", "the second register of secondary codes feeds back as the first does", L1C_CODES),
    fault("gnss.qzss.health", "bits of L1C/B count for L1 C/A", QZSS_HEALTH),
    fault("gnss.qzss.l1cb", "J04 sends L1 C/A for ever", QZSS_SENDERS),
    fault("gnss.qzss.axis", "elements of QZSS count from 200 m less", QZSS_CNAV),
    fault("gnss.b1c.truncation", "codes of B1C begin a chip late", B1C_CODES),
    fault("gnss.bcnav1.time", "frames of B1C are taken for the ones before", FRAMES_B1C),
    fault("gnss.b2a.register", "the register of B2a's data feeds back from the stage before", B2_CODES),
    fault("gnss.b2b.register", "the register of B2b feeds back from the stage after", B2_CODES),
    fault("gnss.bcnav.second", "messages of B2a and B2b are taken for the ones before", MESSAGES_B2),
    fault("gnss.bcnav.preamble", "a symbol of the preambles of B2a and B2b is wrong", PRINTED_B2),
    fault("gnss.bcnav.issue", "message 11 of B2a is of the set of any message", MIXED_B2),
    fault("gnss.bcnav.delays", "B2a has the group delay of B1C", CARRIED_B2),
    fault("gnss.bdgim.obliquity", "slant contents are a hundredth greater", BDGIM),
    fault("gnss.bdgim.pole", "the geomagnetic pole is as far east as it is west", BDGIM),
    fault("gnss.bdgim.norm", "harmonics that have an order are normalised as those that have none", BDGIM),
    fault("gnss.bdgim.hour", "the forecast is that of an interval's beginning", BDGIM),
    fault("gnss.bdgim.least", "the least vertical content is half as much", BDGIM),
    fault("gnss.bdgim.fifth", "the fifth coefficient is above zero, sent and read", BDGIM_FIELDS),
    fault("gnss.bcnav.leap", "BDT's leap seconds are those of GPS time", UTC_B2),
    fault("gnss.fec.field64", "elements of six bits are of another field", FIELD_64),
    fault("gnss.l1c.insertion", "the seven chips are put into the code of L1C a chip late", L1C_CODES),
    fault("gnss.l1c.secondary_code", "the register of L1C's secondary code feeds back from the stages before", L1C_CODES),
    fault("gnss.fec.ldpc", "parity of low density leaves the last bit out", FRAMES_L1C),
    fault("gnss.cnav2.time", "the count of a frame is taken for its own beginning", FRAMES_L1C),
    fault("gnss.cnav2.isc", "L1C is corrected as its data are", DELAYS),
    fault("gnss.exchange.accuracy", "accuracies in records of CNAV have no sign", WRITTEN),
    fault("gnss.cnav.l2c_order", "messages of CNAV on L2C last as long as those of L5", CIVIL),
    fault("gnss.cnav.order", "messages of CNAV come one position early", CIVIL),
    fault("gnss.cnav.count", "the count of a message is taken for its own beginning", CIVIL),
    fault("gnss.cnav.isc", "corrections between signals have the wrong sign", CARRIED),
    fault("gnss.altboc.odd_chips", "the sub-carrier of E5 is upright on every chip", ALTBOC),
    fault("gnss.altboc.delay", "both sides of E5 are delayed like the upper one", DELAYS),
    fault("receiver.correlate.side", "taps of both sides turn the wrong way", SIDES),
    fault("receiver.sides.secondary_code", "both sides are added without the signs of their secondary codes", SIDES),
    fault("gnss.e6.codes", "the code of E6 is that of another satellite", E6_CODES),
    fault("gnss.e6.delay", "E6 has the group delay of E1 by its wavelength", DELAYS),
    fault("gnss.galileo_cnav.pattern", "pages of C/NAV begin with the inverse of their pattern", E6_PAGES),
    fault("receiver.decode.dated", "a page that is given its second is taken for the one after it", E6_TIME),
    fault("gnss.e5.registers", "the second registers of E5 give the other bit", E5_CODES),
    fault("gnss.fnav.clock", "the clock of F/NAV is on the other side of that of I/NAV", E5_PAGES),
    fault("gnss.fnav.page_order", "pages of F/NAV come one position early", E5_PAGES),
    fault("gnss.inav.word_order_e5b", "words on E5b come one page early", E5_PAGES),
    fault("receiver.position.dispersion", "the ionosphere is weighted as on the other carrier", TWO_BANDS),
    fault("receiver.position.dispersion_delay", "group delays enter the ionosphere with the wrong sign", TWO_BANDS),
    fault("receiver.position.dispersion_square", "the ionosphere on L1 follows from the carriers' ratio", NO_L1),
    fault("receiver.position.dispersion_sigma", "the sigma of the measured ionosphere is halved", NO_L1),
    fault("receiver.position.locked", "a combination is as old as its older carrier", COMBINED),
    fault("receiver.smooth.gain", "a combination may jump by no more than one code", COMBINED),
    fault("receiver.position.share", "codes are weighted as if all power were in the pilot", SHARE),
    fault("receiver.nco.channel", "codes of GLONASS are aided by the middle channel", FDMA),
    fault("generator.synth.layers", "BOC(6,1) has eight tenths of its amplitude", LAYERS),
    fault("generator.synth.edge_share", "what edges take from a component is put back", SHARES),
    fault("gnss.exchange.satellites", "epochs of observation files count observations", WRITTEN_OBS),
    fault("gnss.exchange.slips", "observation files flag no slip", WRITTEN_OBS),
    fault("gnss.exchange.channels", "headers name GLONASS's channels with the other sign", WRITTEN_OBS),
    fault("analysis.errors.join", "observations are joined with the satellite's first epoch", JOBS),
    fault("analysis.errors.code_scale", "code errors are halved", JOBS),
    fault("analysis.errors.doppler", "Doppler errors are zero", JOBS),
    fault("analysis.errors.position_scale", "position errors are halved", JPOS),
    fault("analysis.errors.velocity", "velocity errors are zero", JPOS),
    fault("analysis.errors.clock", "clock errors are a tenth", JPOS),
    fault("analysis.errors.slip_size", "slips below two cycles are not seen", JDAM),
    fault("analysis.statistics.percentile", "a percentile is taken at the wrong rank", STAT),
    fault("analysis.statistics.deviation", "a standard deviation has the wrong divisor", STAT),
    fault("analysis.consistency.axes", "sigmas of east and up are exchanged", JPOS),
    fault("analysis.summary.horizontal", "the horizontal error forgets north", JPOS),
    fault("analysis.summary.navigation", "no navigation parameter is ever wrong", JDAM),
    fault("analysis.summary.false_satellites", "no satellite is ever false", JDAM),
    fault("analysis.peaks.delay", "correlation peaks are mirrored about the true delay", PEAK),
    fault("analysis.peaks.half", "correlation peaks are half a sample late", PEAK),
    fault("analysis.verdict.limit", "limits are a hundred times as wide", JDAM),
    fault("analysis.multiple_access.others", "other satellites count ten times", JOBS),
    fault("analysis.samples.floor", "the noise under a spectrum is 0.13 dB too high", JSPEC),
    fault("analysis.samples.codes", "satellites count half in a spectrum", JSPEC),
    fault("analysis.response.poles", "the poles of a Butterworth filter are turned", POLES),
    fault("analysis.theory.pll", "theory of the phase loop has the wrong constant", JIT),
    fault("analysis.theory.dll", "theory of the code loop has the wrong constant", JIT),
    fault("analysis.detection.label", "tests have the labels of the interval before", LABELS),
    fault("analysis.allan.half", "the Allan variance is not halved", JALL),
    fault("rtk.rows.sign", "carriers are differenced base minus rover", BASELINE),
    fault("rtk.pairs.second_band", "every band has the wavelength of the first", BASELINE),
    fault("rtk.pairs.broken", "what the rover says of a broken count is not heard", BROKEN),
    fault("rtk.solver.outage", "what is said of broken counts in an epoch without a position is forgotten", BROKEN),
    fault("rtk.orbits.travel", "satellites are taken where they are at reception", BASELINE),
    fault("rtk.normal.clock", "the common clock is eliminated by half", BASELINE),
    fault("rtk.lambda.decorrelation", "the transformation is that of other integers", INTEGERS),
    fault("rtk.lambda.norm", "squared norms are not divided by variances", INTEGERS),
    fault("rtk.lambda.success_rate", "a success rate is that of half the deviation", SUCCESS),
    fault("rtk.judge.base", "true integers are without the base's carriers", BASELINE),
    fault("logs.rtcm.check", "the check of a frame is without its head", RTCM_PRINTED),
    fault("logs.rtcm.beidou_time", "BeiDou's time is ahead of GPS time, as read", RTCM_OBSERVED),
    fault("logs.rtcm.carrier_scale", "fine carriers have twice their scale, written and read", RTCM_OBSERVED),
    fault("logs.rtcm.channel", "channels of GLONASS count downwards, as read", RTCM_OBSERVED),
    fault("logs.rtcm.lock", "lock times double too late, written and read", RTCM_LOCK),
    fault("logs.rtcm.magnitude", "a magnitude has no sign, as read", RTCM_ORBITS),
    fault("logs.rtcm.semicircle", "angles are in radians, written and read", RTCM_ORBITS),
];
