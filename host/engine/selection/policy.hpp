// Thresholds of the diagnosis that decide about names, in one place, each with its unit and its source. Steps are those
// of METHOD.md.
#pragma once

#include <array>
#include <cstddef>

#include "host/engine/selection/named_score.hpp"

namespace flexspline::selection {

struct SelectionPolicy {
  // Bandwidths: the highest, and four lower ones, each by this factor.
  std::size_t bandwidths = 5;
  double bandwidth_factor = 0.7071;
  // Highest bandwidth, Hz: above the coherent motion of drives, below the resonances of arms. Presliding shows at 20
  // Hz.
  double highest_hz = 40.0;
  // The same for waves over the motor's angle.
  double widest_hz = 200.0;
  double widest_over_sampling = 0.4;
  // The motion's filter over the target's, as the columns are filtered once more.
  double motion_over_row = 2.5;
  // Share of a bandwidth up to which a wave is taken, and of the motion's bandwidth from which on a wider one takes it.
  double wave_below_bandwidth = 0.7;
  double wave_above_motion = 0.35;
  // A bandwidth that is wider by less is none of its own. Where the highest order needs a wider one, it is at least the
  // second.
  double wider_bandwidth = 1.2;
  double least_widening = 1.25;
  // Share of the variance of an acceleration that may be noise of the position: the attenuation of the inertia.
  double acceleration_noise_share = 0.02;
  // Noise of the inertia's torque over the residual, as variances: what noise of a regressor may add to the residual.
  double regressor_noise_share = 0.05;
  // Semivariance of neighbours over the variance, 1 for white noise and 0 for a slow signal: above, what the load's
  // model leaves of a measured torque is noise of its sensor.
  double torque_noise_share = 0.5;
  // A motor that moves by that many standard errors of its velocity is in motion; that many periods of the cut-off
  // without are rest: half of what the filter passes of a sample is of a quarter of a period about it. With half a
  // period ideal dry friction was taken for presliding in 9 of 144 simulated machines that stop between their moves.
  double visible_velocity = 3.0;
  double rest_periods = 0.25;

  // Resampling: complementary pairs (Shah and Samworth 2013, who use 50).
  std::size_t blocks = 24;
  std::size_t pairs = 48;                   // for each bandwidth and mask
  std::size_t fewest_records_to_split = 4;  // from so many on every second pair halves the records, not their blocks
  std::size_t most_steps = 4;
  // Values of a nonlinear parameter that halves choose from: over its range, and between the neighbours of the two
  // that take off most of all data. A Gaussian law between two of a coarse grid takes off two thirds of its squares
  // only, less than a curve of no catalogue (logs of simulated machines whose speeds span two decades).
  std::size_t grid_points = 8;
  std::size_t finer_grid_points = 6;
  double named_frequency = 0.6;       // Meinshausen and Buehlmann 2010: 0.6 to 0.9
  double min_frequency_of_all = 0.5;  // with abstaining subsamples counted as not choosing: the least that Meinshausen
                                      // and Buehlmann's bound of false selections allows
  double unconfirmed_frequency = 0.75;  // where held-out experiments do not confirm it (by hand, two logs)
  double certain_frequency = 0.9;       // behind a structure that is in no catalogue

  // Share of the squares above the noise that a term has to take off on samples that the fit did not see.
  double line_share = 0.05;  // a linear term
  double law_share = 0.10;   // a term with nonlinear parameters
  // Smallest decrease of the deviance (twice the log-likelihood): chance alone gives a term with two parameters 6 in
  // one of 20 cases.
  double least_gain = 6.0;
  // A subsample without that share of its squares above the noise abstains.
  double least_excess = 0.03;
  // Coefficients below their bound by no more than that share of the target are noise about zero.
  double noise_below_bound = 0.02;

  double curve_discount = 0.8;  // a law has to take off at least this share of what any curve does
  double similar = 0.9;         // terms that take off that share of the best one's are not distinguished,
  double similar_left = 2.0;    // unless they leave that many times the squares above the noise
  double often_similar = 0.3;   // of the subsamples that chose a term: an alternative so often belongs to its group

  double group_frequency = 0.5;      // of the subsamples that chose the first of a group; and from which on a term that
                                     // was chosen first is not behind a structure that is in no catalogue
  double least_own_frequency = 0.3;  // of the first of a group
  double most_abstaining = 0.75;     // of the subsamples
  // Of the subsamples: where more abstain, halves do not judge what likelihood names, as no majority can choose it.
  double most_abstaining_to_judge = 0.5;

  // Squared error per sample of the half that validates over that of the half that fits: above, the model itself does
  // not hold on other data.
  double max_validation_to_training = 3.0;
  // The same on held-out experiments, for a model whose friction differs between records.
  double max_held_out_growth = 3.0;

  // Friction of one drive differs between runs by 0 to 10 %, by 3 % mostly: a prior worth that many records.
  double friction_difference = 0.03;
  double friction_difference_records = 2.0;
  // From so many records on the prior is left out: they determine that standard deviation to 27 % (1/sqrt(2(n - 1))),
  // and with it friction that does not differ would count as differing by 1 %, which hides what is that small.
  std::size_t records_without_prior = 8;
  double least_friction_difference = 0.005;
  double most_friction_difference = 0.5;

  // Error on experiments that are held out, with a term over without it: above, the term is not named.
  double most_held_out_ratio = 1.0;

  // Share of the squared error on experiments that are held out: a term that takes off so much there matters, and needs
  // no more than the usual share of the subsamples, whatever else is missing.
  double matters_share = 0.2;
  // RMS error without a large effect over that with it, the noise in both.
  double large_rise = 1.2;
  // Most of it. What takes off so much needs no majority of the subsamples, only none against it; and a wave of the
  // output's angle whose likelihood is not significant needs as much: over a part of a turn it takes off a part of any
  // slow function of the angle (by hand, robot-like twins).
  double most_share = 0.5;

  double white = 0.95;  // semivariance over variance of what is left: above, it is noise

  // What corrects the effort: at most that share of it at its peaks, and only where the peaks are that much above the
  // median.
  double most_of_effort = 0.3;
  double least_effort_range = 2.0;

  // Presliding needs that many reversals. Its travel, in rad of the motor: the state comes to its end within a quarter
  // of a stroke (exp(-4) is left), and the hysteresis of gears is far below 1 rad of the motor (10 mrad of the output
  // at a ratio of 100); a longer one would be a spring or a drift. It is seen over that many standard deviations of
  // the noise of the position.
  double fewest_reversals = 3.0;
  double longest_presliding = 1.0;
  // Standard errors of the parts left out by which the error has to be larger without a travel: Student's t of five
  // parts, one-sided 97.5 %.
  double travel_errors = 2.776;
  // Percent of the squared error that reversals add which a law of presliding has to explain. Of an axis that only
  // sticks it explained 49 %, of nine with presliding 80 % and more (logs of two engineers, by hand).
  double reversals_explained_percent = 66.0;
  double presliding_of_stroke = 0.25;
  double least_travel_noise = 4.0;
  double presliding_shape_factor = 4.0;  // of shorter and longer bristles over the travel of the law

  // Squared error of a model on data left out of the fit over that on the fitted. With p parameters from n independent
  // samples (n + p)/(n - p) is expected (Akaike 1969, final prediction error): 2 is three samples for each parameter.
  double most_left_out_squares = 2.0;
  // Samples for each column of a fit: with fewer, halves of the data say nothing.
  double fewest_rows_per_column = 10.0;
  // Rows of the table by which effort and motion may be stamped apart, as loggers differ by a few samples; and seconds
  // up to which the range is doubled where the best lag is at its end: the longest delay of an amplifier that the
  // catalogue has, and a quarter more.
  int usual_lag_rows = 4;
  double longest_lag_s = 0.025;
  // From so many samples on a lag is a delay of the current: by half a sample a held effort may be aligned wrongly, by
  // one the order in which a logger reads its columns.
  double least_delay_samples = 1.5;

  // Resampling against likelihood on the motor's balance.
  // Percent of the left-out chi-square from which on what resampling cannot choose counts by itself: what was named
  // instead of another effect took off at most 96 % in robot-like twins, a limit of the current that is there 99 %.
  double nearly_all_percent = 98.0;
  double floor_uncertainty = 0.1;   // relative, of a floor of some ten periods
  double filter_uncertainty = 0.2;  // relative, of an autocorrelation time

  // Likelihood on one balance.
  // Score (twice the log-likelihood gain less k ln n_eff) from which on an effect may be named: one in 1000 sets with
  // nothing hidden passes it; calibrated by `./dev soak MINUTES calibrate`.
  double named_score = kNamedScore;
  // Percent of the left-out chi-square: an effect must matter, not only be there (step 7).
  double named_chi2_percent = 0.5;
  // What makes an effect needless explains as much as that one does; half of it alone, as its nonlinear parameters may
  // be found better with the other in the model.
  double least_alone_share = 0.5;
  // Score within which two effects are not distinguished (step 12).
  double confounded_margin = 10.0;
  // Difference of the BIC of two models from which on it is positive evidence for one of them (Kass and Raftery 1995).
  double positive_evidence = 2.0;
  // Of the one-sided sign test over records that were predicted without them: four of four are enough, three of three
  // are not.
  double sign_test_p_value = 0.1;
  // Share of a candidate's torque that is orthogonal to the model: below, both are one in the data (by hand, on drives
  // with an effect that the model has in another form).
  double least_orthogonal_share = 0.003;
  // Residual over noise floor: what the filters leave around reversals repeats with the motion, so a true model is
  // some 15 % above its floor on simulated drives.
  double at_floor = 1.3;
  // A candidate that takes as much off the left-out chi-square, in percent, may change the base model as it likes (by
  // hand: loads that the model lacks wholly).
  double all_explained_percent = 99.0;
  // Else it may not change the torque of a base effect of physical sign by more than that share of the larger one, if
  // that effect stands out by so many standard errors and is so many times what is missing (by hand, seeds below 1100).
  double most_base_change = 0.5;
  double known_base_errors = 5.0;
  double known_base_over_missing = 2.0;
  // Velocity over the end of its range (a quarter of the fast motion) from which on a negative law is wide
  // (shared/effects/CATALOGUE.md).
  double wide_share_of_range = 0.4;

  // A law that contains another one fits at least as well. How much more the simpler one may leave: of the error itself
  // as a ratio of squares, and of what was missing as a share. On drives with laws of friction and hysteresis of which
  // one contains the other: where the simpler one was the truth the other took 0.02 % of what was missing (0.8 % where
  // an encoder smears it), by however much it led; where the wider one was, at least 0.2 %.
  struct Same {
    double left, share_of_missing;
  };
  Same same{2.25, 0.001};
  Same same_below_resolution{2.89, 0.01};
  Same hardly_more{1.21, 0.005};
  // Or its error is larger by less than one standard error of the parts left out (Breiman, Friedman, Olshen and Stone
  // 1984: the one-standard-error rule): where something else is missing, too, the parts disagree which law is better.
  double simpler_standard_errors = 1.0;
  double least_travel_quanta = 20.0;  // travels of fewer encoder steps are not resolved (the same drives)
  double many_parameters = 12.0;      // a law of so many more is confounded with any

  // Orders per motor turn.
  int highest_order = 24;            // of gears and motors: the wave generator's, slots, poles and bearings
  std::size_t orders_tried = 3;      // those that the residual holds most of
  std::size_t orders_resampled = 6;  // likewise, of each effect and of as many placebos, on halves of the data
  double usual_order_share = 0.9;    // of the best one's squares: from there the usual order is tried, too
  double fewest_cycles = 2.0;        // of an order in the data; and turns of the motor, for friction over a turn
  // Placebo orders, which no gear, motor or bearing makes: in data of few turns they explain as much as any. Likelihood
  // compares with those from the first on, each one more; halves choose from a list of which none is within a fifth of
  // a whole number or of a half, as its waves would be theirs in short records.
  double first_placebo_order = 0.63;
  int placebo_orders = 24;
  std::array<double, 12> placebo_orders_resampled{1.27, 2.73, 3.29,  4.71,  5.29,  6.73,
                                                  8.27, 9.71, 11.29, 13.73, 16.27, 19.71};
  // Placebos for the orders of the output's turn, in units of the lowest of them; and the range of angles that a record
  // must have for such an order, in its cycles.
  double least_range_of_cycle = 1.25;
  std::array<double, 4> placebos_of_output_turn{0.63, 1.37, 2.71, 3.29};
  double least_over_placebo = 1.5;  // squares over those of the best placebo (by hand, records of one to five turns)
  // Where nothing but noise is left, likelihood distinguishes orders although a wrong one may explain most of it: score
  // over that of any placebo.
  double score_over_placebo = 3.0 * kNamedScore;
  // A true order shows in so many of the parts of the data, and not in one of them mostly (by hand, bursts).
  std::size_t order_parts = 8;
  int order_parts_with_gain = 5;
  double most_in_one_part = 0.7;

  // Visibility.
  double least_temperature_span = 3.0;  // degC: less shows no effect of temperature
  double least_loaded_share = 0.1;      // torque of the sensor over the motor's: above, it fixes the torque scale
  double least_direction_share = 0.1;   // samples of the rarer direction that make a record one of both directions
  int fewest_one_way_records = 3;       // of each direction, where no record has both
  double one_way_share = 0.01;          // samples of the rarer direction below which data count as one way

  // Disturbances (by hand: pushes on a simulated axis, against bursts that filters make of friction at reversals).
  double far_out = 6.0;           // robust standard deviations
  double longest_burst_s = 0.15;  // what lasts longer is a state of the drive
  double burst_repeats = 0.35;    // share of like samples that stand out too: above, it depends on that signal
  std::size_t like_rows = 120;    // that count as like ones
  double most_disturbed = 0.3;    // of a record: more is no exception

  // What is reported in addition to the name.
  double shown_share_percent = 5.0;        // maps of a complete model show significant shares of a few percent
  double least_shown_share_percent = 1.0;  // where much is left
  double delay_errors = 5.0;               // standard errors from which on a delay is reported
  // Of the chi-square above the noise: the best substitute for an effect that is not in the catalogue takes off 60 %
  // and less (step 14).
  double recovered_percent = 80.0;
  double worth_adding = 0.003;  // of the first decrease of chi-square (step 16)

  // Structure outside the catalogue. A curve has many numbers and the best of some two dozen signals is taken, so it
  // must show more than an effect of the catalogue; both limits were set on drives that lack nothing.
  double curve_score = 60.0;
  double curve_chi2_percent = 3.0;
  // What is named must recover this share of what a curve does: substitutes for unknown laws stay below, effects of the
  // catalogue that are the nearest to one above.
  double curve_recovered = 0.9;
  double recovered_by_two = 0.98;  // two that are right leave nothing to a curve
  double simpler_curve = 0.02;     // of the left-out squares: a simpler curve is taken where it predicts as well
  // A table that a user adds: below that score it is noise that was fitted, and it must lower the left-out squares
  // by that many percent.
  double table_score = 20.0;
  double least_table_percent = 0.1;

  // Values of a named linear effect must differ from zero (Wald), whatever else speaks for it.
  double wald_p_value = 0.05;

  // Trends of parameters over experiments (step 14).
  std::size_t fewest_of_trend = 6;    // experiments
  double trend_p_value = 1e-3;        // after the correction for what was tried
  double range_p_value = 0.01;        // of a law that holds for the slower or the faster records: is told, not named
  std::size_t fewest_of_scaling = 4;  // records: with fewer a line through them has one degree of freedom
  double scaling_p_value = 1e-3;      // of an effect that scales friction by a recorded signal, for all that were tried
  double scaling_over_range = 2.0;    // of its coefficient over the range's end: to first order it comes out too large
  double shown_within_records = 0.25;  // share of the signal's variance within records from which on they show it
  double known_inertia = 0.2;          // relative standard error up to which a record's inertia is compared
  double inertia_errors = 5.0;         // standard errors by which two of them differ: several pairs are compared
  double trend_size = 0.03;            // of the parameter, over the records
  double least_drift = 0.01;           // relative standard deviation of friction between records that is reported
  double drift_deviance = 12.0;        // twice the log-likelihood ratio of random effects against none
};

// The policy that all commands follow.
inline constexpr SelectionPolicy kPolicy{};

}  // namespace flexspline::selection
