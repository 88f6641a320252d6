#include "host/estimation/partition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "host/estimation/variable_projection.hpp"

namespace flexspline::estimation {
namespace {

bool has_free_nonlinear(const Term& term) {
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.free_nonlinear(p)) return true;
  return false;
}

// Puts the parameters of one fit before those of another one on the same balance.
void put_before(BalanceFit& fit, const BalanceFit& first, const std::vector<std::size_t>& term_now) {
  std::vector<ParameterRef> linear;
  for (ParameterRef ref : first.linear) {
    ref.term = term_now[ref.term];
    linear.push_back(ref);
  }
  const auto before = static_cast<Eigen::Index>(linear.size());
  const Eigen::Index after = fit.covariance.rows();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(before + after, before + after);
  covariance.topLeftCorner(before, before) = first.covariance.topLeftCorner(before, before);
  covariance.bottomRightCorner(after, after) = fit.covariance;
  Eigen::VectorXd own(before + after);
  own << first.root_tolerance.head(before), fit.root_tolerance;
  Eigen::VectorXd excitation(before + after);
  excitation << first.excitation.head(before), fit.excitation;
  linear.insert(linear.end(), fit.linear.begin(), fit.linear.end());
  fit.linear = std::move(linear);
  fit.covariance = std::move(covariance);
  fit.root_tolerance = std::move(own);
  fit.excitation = std::move(excitation);
  fit.condition_number = std::max(fit.condition_number, first.condition_number);
}

}  // namespace

std::unique_ptr<Identification> partitioned(const data::Dataset& dataset, const model::Model& model,
                                            const PipelineOptions& pipeline) {
  model::Model simple = model;
  std::erase_if(simple.effects, [](const model::Effect& effect) { return has_free_nonlinear(term_of(effect)); });
  auto all = form(dataset, model, pipeline);
  if (simple.effects.empty() || simple.effects.size() == model.effects.size()) {
    fit(*all);
    assemble(*all);
    return all;
  }
  auto first = form(dataset, simple, pipeline);
  fit(*first);
  std::vector<std::size_t> term_now(first->terms.size());
  std::vector<ParameterRef> plugged_in;
  for (std::size_t t = 0; t < first->terms.size(); ++t)
    for (std::size_t now = 0; now < all->terms.size(); ++now) {
      if (all->terms[now].id != first->terms[t].id) continue;
      term_now[t] = now;
      for (std::size_t p = 0; p < all->terms[now].values.size(); ++p) {
        if (!all->terms[now].free_linear(p)) continue;
        all->terms[now].values[p] = first->terms[t].values[p];
        all->terms[now].known[p] = 1;
        plugged_in.push_back({now, p});
      }
    }
  fit(*all);
  for (const ParameterRef& ref : plugged_in) all->terms[ref.term].known[ref.parameter] = 0;
  for (BalanceFit& fit : all->fits)
    for (const BalanceFit& before : first->fits)
      if (before.balance == fit.balance) put_before(fit, before, term_now);
  all->warnings.insert(all->warnings.end(), first->warnings.begin(), first->warnings.end());
  assemble(*all);
  return all;
}

void search_from_several_starts(Identification& identification, int starts, std::uint64_t seed) {
  constexpr double kLike = 1e-3;   // of the sum of squares
  constexpr double kApart = 0.05;  // of a nonlinear parameter's range
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (std::size_t b = 0; b < identification.fits.size(); ++b) {
    BalanceFit& fit = identification.fits[b];
    BalanceData& data = identification.data[b];
    std::vector<ParameterRef> open;
    for (const ParameterRef& ref : fit.nonlinear)
      if (!identification.terms[ref.term].stated[ref.parameter]) open.push_back(ref);
    if (open.empty()) continue;
    Terms best = identification.terms;
    double least = refine_nonlinear(data, best, fit.on_balance, fit.root_weights);
    const double swept = least;
    bool ends_apart = false;
    for (int start = 1; start < starts; ++start) {
      Terms candidate = identification.terms;
      for (const ParameterRef& ref : open)
        candidate[ref.term].values[ref.parameter] =
            parameter_range(data, candidate[ref.term], ref.parameter).at(share(random));
      const double cost = refine_nonlinear(data, candidate, fit.on_balance, fit.root_weights);
      bool apart = false;
      for (const ParameterRef& ref : open) {
        const ParameterRange range = parameter_range(data, candidate[ref.term], ref.parameter);
        apart = apart || std::abs(range.share(candidate[ref.term].values[ref.parameter]) -
                                  range.share(best[ref.term].values[ref.parameter])) > kApart;
      }
      ends_apart = ends_apart || (apart && std::abs(cost - least) < kLike * least);
      if (cost < least) {
        least = cost;
        best = candidate;
      }
    }
    if (ends_apart)
      identification.warnings.push_back(
          "searches from several starts end at different nonlinear parameters with the same error: these data do not "
          "identify them (--intervals profile shows how far)");
    if (least > (1.0 - 1e-6) * swept) continue;
    // From the better place, as if the model stated it.
    for (const ParameterRef& ref : open) {
      const Term& term = best[ref.term];
      identification.terms[ref.term].values[ref.parameter] = term.values[ref.parameter];
      identification.terms[ref.term].stated[ref.parameter] = 1;
    }
    fit = fit_balance(data, identification.terms);
  }
}

}  // namespace flexspline::estimation
