// Quantiles and probabilities of the usual distributions: Boost.Math behind one file, as its templates take seconds to
// compile. Degrees of freedom need not be whole. What is no probability or no degree of freedom: std::domain_error.
#pragma once

namespace flexspline::numbers {

// Below the quantile a draw lies with that probability.
double normal_quantile(double probability);
double chi_squared_quantile(double freedom, double probability);
double student_t_quantile(double freedom, double probability);

// Probability of a draw up to x.
double normal_up_to(double x);

// Probability of a draw above x: the p-value of a test.
double chi_squared_above(double freedom, double x);
double student_t_above(double freedom, double x);
double fisher_f_above(double numerator_freedom, double denominator_freedom, double x);

// Probability of `least` or more successes in `trials` (at least one), each with that probability.
double binomial_at_least(int least, int trials, double probability);

}  // namespace flexspline::numbers
