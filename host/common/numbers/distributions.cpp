#include "host/common/numbers/distributions.hpp"

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace flexspline::numbers {

namespace math = boost::math;

double normal_quantile(double probability) {
  return math::quantile(math::normal(), probability);
}
double chi_squared_quantile(double freedom, double probability) {
  return math::quantile(math::chi_squared(freedom), probability);
}
double student_t_quantile(double freedom, double probability) {
  return math::quantile(math::students_t(freedom), probability);
}

double normal_up_to(double x) {
  return math::cdf(math::normal(), x);
}

double chi_squared_above(double freedom, double x) {
  return math::cdf(math::complement(math::chi_squared(freedom), x));
}
double student_t_above(double freedom, double x) {
  return math::cdf(math::complement(math::students_t(freedom), x));
}
double fisher_f_above(double numerator_freedom, double denominator_freedom, double x) {
  return math::cdf(math::complement(math::fisher_f(numerator_freedom, denominator_freedom), x));
}

double binomial_at_least(int least, int trials, double probability) {
  if (least <= 0) return 1.0;
  return math::cdf(math::complement(math::binomial(trials, probability), least - 1));
}

}  // namespace flexspline::numbers
