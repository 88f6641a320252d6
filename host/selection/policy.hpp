// Every threshold of the diagnosis in one place, with its unit and its source.
#pragma once

#include <cstddef>

namespace flexspline::selection {

struct SelectionPolicy {
  // Bandwidths: the highest, and four lower ones, each by this factor.
  std::size_t bandwidths = 5;
  double bandwidth_factor = 0.7071;
  // Highest bandwidth, Hz: above the coherent motion of drives, below the resonances of arms (METHOD: presliding shows
  // at 20 Hz).
  double highest_hz = 40.0;
  // Of the rows, for waves over the motor's angle.
  double widest_hz = 200.0;
  double widest_over_sampling = 0.4;
  // Share of the variance of an acceleration that may be noise of the position: the attenuation of the inertia.
  double acceleration_noise_share = 0.02;
  // Noise of the inertia's torque over the residual, as variances: what noise of a regressor may add to the residual.
  double regressor_noise_share = 0.05;

  // Resampling (Shah and Samworth 2013: complementary pairs; 50 pairs bound the error of a frequency to 0.07).
  std::size_t blocks = 24;
  std::size_t pairs = 12;                   // for each bandwidth and mask
  std::size_t fewest_records_to_split = 4;  // from so many on every second pair halves the records, not their blocks
  std::size_t most_steps = 4;
  double named_frequency = 0.6;    // Meinshausen and Buehlmann 2010: 0.6 to 0.9
  double certain_frequency = 0.9;  // behind a structure that is in no catalogue

  // Share of the squares above the noise that a term has to take off on samples that the fit did not see.
  double line_share = 0.05;  // a linear term
  double law_share = 0.10;   // a term with nonlinear parameters
  // Log-likelihood gain, in units of one: chance alone gives a term with two parameters 6 in one of 20 trials.
  double least_gain = 6.0;
  // A subsample without that share of its squares above the noise abstains.
  double least_excess = 0.03;

  double curve_discount = 0.8;  // METHOD: a law takes at least 80 % of what any curve does
  double alike = 0.9;           // terms that take off that share of the best one's are not distinguished,
  double alike_left = 2.0;      // unless they leave that many times the squares above the noise

  double group_frequency = 0.5;      // of the subsamples that chose the first of a group
  double least_own_frequency = 0.3;  // of the first of a group
  double most_abstaining = 0.75;     // of the subsamples

  double most_leverage = 3.0;  // error per row of the half that judges over that of the half that fits: beyond, the
                               // model itself does not carry over

  // Friction of one drive differs between runs by 0 to 10 %, by 3 % mostly (METHOD): worth that many records.
  double friction_difference = 0.03;
  double friction_difference_records = 2.0;

  double most_held_out_ratio = 1.02;  // error on experiments that are held out, with a term over without it: below,
                                      // the difference is that of short records

  double white = 0.95;  // semivariance over variance of what is left: above, it is noise

  // What corrects the effort: at most that share of it at its peaks, and only where the peaks are that much above the
  // median.
  double most_of_effort = 0.3;
  double least_effort_range = 2.0;

  // Presliding needs that many reversals.
  double fewest_reversals = 3.0;
};

}  // namespace flexspline::selection
