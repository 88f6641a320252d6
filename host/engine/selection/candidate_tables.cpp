#include "host/engine/selection/candidate_tables.hpp"

#include <algorithm>
#include <cmath>

#include "host/engine/estimation/modelled_torque.hpp"
#include "host/engine/selection/modelled_torque.hpp"
#include "host/engine/selection/presliding.hpp"

namespace flexspline::selection {
namespace {

// At the highest bandwidth; wider where waves over the motor's angle are above the bandwidth of the motion.
estimation::PreparedData prepare(const std::vector<const data::Experiment*>& experiments, const model::Drive& drive,
                                 double highest_hz, const SelectionPolicy& policy) {
  double slowest_hz = 1e300;
  for (const data::Experiment* e : experiments) slowest_hz = std::min(slowest_hz, 1.0 / e->sample_s);
  estimation::Pipeline pipeline;
  pipeline.motion_cutoff_hz = std::min(policy.motion_over_row * highest_hz, 0.45 * slowest_hz);
  pipeline.mask = false;
  pipeline.row_cutoff_hz = highest_hz;
  estimation::PreparedData prepared = estimation::prepare_with(experiments, drive, pipeline);
  double widest_hz = highest_hz;
  // Where an order that the motor gives is above what the highest bandwidth takes, but hardly.
  const double order_hz = highest_order_hz(prepared);
  const bool is_beyond =
      highest_order(drive) > policy.highest_order && order_hz > policy.wave_below_bandwidth * highest_hz;
  const double least_hz = is_beyond ? policy.least_widening * highest_hz : 0.0;
  const double wanted_hz =
      std::min({std::max(1.5 * order_hz, least_hz), policy.widest_over_sampling * slowest_hz, policy.widest_hz});
  while (widest_hz < 0.99 * wanted_hz) widest_hz = std::min(2.0 * widest_hz, wanted_hz);
  if (widest_hz <= policy.wider_bandwidth * highest_hz) return prepared;
  pipeline.row_cutoff_hz = widest_hz;
  return estimation::prepare_with(experiments, drive, pipeline);
}

estimation::PreparedData without_held_out(estimation::PreparedData prepared) {
  std::erase_if(prepared.records,
                [](const estimation::Record& r) { return r.experiment->role == data::Role::holdout; });
  return prepared;
}

// The travel of presliding with which the model alone leaves least, and shorter and longer ones that the data can show;
// nothing where none can be shown.
std::optional<PreslidingTravels> best_presliding_travels(const estimation::PreparedData& prepared,
                                                         const estimation::Terms& terms, Balance balance,
                                                         const SelectionPolicy& policy) {
  if (balance != Balance::motor || presliding_law(terms) == nullptr) return std::nullopt;
  const estimation::PreparedData fitted = without_held_out(prepared);
  const std::vector<double> travels = presliding_travels(fitted, policy);
  const std::vector<double> squares = squares_by_travel(fitted, terms, travels);
  if (squares.empty()) return std::nullopt;
  const auto least = std::min_element(squares.begin(), squares.end());
  PreslidingTravels best;
  best.is_resolved = least != squares.begin();
  best.state = travels[static_cast<std::size_t>(least - squares.begin())];
  for (const double factor : {1.0 / policy.presliding_shape_factor, policy.presliding_shape_factor}) {
    const double travel = std::clamp(factor * best.state, travels.front(), travels.back());
    if (std::abs(std::log(travel / best.state)) > 0.5 * std::log(policy.presliding_shape_factor))
      best.shape.push_back(travel);
  }
  return best;
}

bool is_of_motion(double cutoff_hz, const Bandwidth& bandwidth) {
  return cutoff_hz <= 1.01 * bandwidth.highest_hz;
}

}  // namespace

const catalogue::Entry* presliding_law(const estimation::Terms& terms) {
  const catalogue::Entry* simplest = nullptr;
  for (const catalogue::Entry& entry : catalogue::all()) {
    if (!entry.is_presliding()) continue;
    const auto names = catalogue::split_names(entry.info->replaces);
    const bool replaces = std::any_of(terms.begin(), terms.end(), [&](const estimation::Term& t) {
      return std::find(names.begin(), names.end(), t.entry->name()) != names.end();
    });
    const bool travels = std::any_of(entry.parameters.begin(), entry.parameters.end(),
                                     [](const effects::ParameterInfo& p) { return p.limit == effects::Limit::travel; });
    if (replaces && travels && (!simplest || entry.parameters.size() < simplest->parameters.size())) simplest = &entry;
  }
  return simplest;
}

bool CandidateTables::may_enter(const CandidateTerm& term, double cutoff_hz) const {
  return term.highest_hz <= kPolicy.wave_below_bandwidth * cutoff_hz &&
         (is_of_motion(cutoff_hz, bandwidth) || term.highest_hz > kPolicy.wave_above_motion * bandwidth.highest_hz);
}

bool CandidateTables::shows_presliding(const std::pair<double, bool>& setting) const {
  return table.presliding && !setting.second && is_of_motion(setting.first, bandwidth);
}

CandidateTables make_tables(const std::vector<const data::Experiment*>& experiments, const model::Drive& drive,
                            const estimation::Terms& terms, Balance balance, const SelectionPolicy& policy) {
  CandidateTables tables;
  tables.bandwidth = highest_bandwidth(experiments, policy);
  const double highest_hz = tables.bandwidth.highest_hz;
  estimation::PreparedData prepared = prepare(experiments, drive, highest_hz, policy);
  tables.torque_has_noise = take_noise_off_torque(prepared) > 0;
  estimation::take_torque_from_load(prepared, terms);
  const std::optional<PreslidingTravels> travels = best_presliding_travels(prepared, terms, balance, policy);
  tables.presliding_is_resolved = !travels || travels->is_resolved;
  tables.table = make_regressor_table(prepared, balance, terms, travels, highest_hz, policy);
  if (tables.table.model_columns == 0) return tables;
  for (double f = prepared.pipeline.row_cutoff_hz; f > policy.wider_bandwidth * highest_hz; f *= 0.5)
    for (const bool mask : {false, true}) tables.settings.emplace_back(f, mask);
  for (std::size_t b = 0; b < policy.bandwidths; ++b)
    for (const bool mask : {false, true})
      tables.settings.emplace_back(highest_hz * std::pow(policy.bandwidth_factor, static_cast<double>(b)), mask);
  return tables;
}

}  // namespace flexspline::selection
