#include "tests/soak/campaign.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

namespace flexspline::soak {
namespace {

constexpr double kVariations[] = {0.0, 0.03};
constexpr double kCorrelation = 0.9;

// Effects whose size can be chosen.
const std::vector<std::string> kHidden = {
    "viscous_asymmetry",
    "coulomb_asymmetry",
    "stribeck_gaussian",
    "load_dependent_friction",
    "power_law_friction",
    "gravity",
    "current_offset",
    "torque_ripple:2",
    "torque_ripple:7",
    "temperature_viscous",
    "dahl_friction",
    "backlash",
    "structural_damping",
    "cubic_stiffness",
    "kinematic_error",
    "temperature_coulomb",
    "stribeck_hess_soom",
    "quadratic_drag",
    "load_scaled_ripple",
    "torque_constant_error",
    "torque_constant_saturation",
    "current_delay",
    "quadratic_stiffness",
    "dahl_hysteresis",
    "modified_dahl_hysteresis",
    "bouc_wen_hysteresis",
    "torque_proportional_hysteresis",
    "torque_offset",
    "torque_sensor_gain",
    "torque_sensor_ripple",
    "torsion_zero",
};
// Effects without a choice of size: laws whose size depends on their nonlinear parameters, and what every drive has.
const std::vector<std::string> kWholeRecord = {
    "lugre_friction",
    "current_saturation",
    "piecewise_stiffness",
    "duhem_hysteresis",
    "prandtl_ishlinskii_hysteresis",
    "preisach_hysteresis",
    "inertia",
    "viscous_friction",
    "coulomb_friction",
    "linear_stiffness",
    "output_inertia",
    "output_viscous_friction",
    "output_coulomb_friction",
};
const std::vector<std::string> kPairs = {
    "viscous_asymmetry+current_offset", "coulomb_asymmetry+torque_ripple:2",
    "stribeck_gaussian+gravity",        "load_dependent_friction+temperature_viscous",
    "gravity+torque_ripple:7",          "stribeck_gaussian+load_dependent_friction",
    "current_offset+coulomb_asymmetry", "structural_damping+viscous_asymmetry"};
const std::vector<std::string> kUnknown = {"stribeck_exponent", "load_power_friction", "triangle_ripple",
                                           "damaged_tooth",     "tight_spot",          "speed_onset"};
constexpr std::size_t kWholeInARound = 4, kPairsInARound = 2, kUnknownInARound = 2, kNothingOfAKind = 4;

nlohmann::json to_json(const Outcome& o) {
  nlohmann::json j = {{"hidden", o.what.hidden},
                      {"scale", o.what.scale},
                      {"seed", o.what.seed},
                      {"friction_variation", o.what.friction_variation},
                      {"noise_correlation", o.what.noise_correlation},
                      {"with", o.what.with},
                      {"named", o.named},
                      {"verdict", o.verdict},
                      {"right", o.right},
                      {"found_all", o.found_all},
                      {"missing_over_noise", o.missing_over_noise},
                      {"best_score", o.best_score},
                      {"seconds", o.seconds},
                      {"detail", o.detail},
                      {"recovered", nlohmann::json::array()}};
  if (o.holdout_over_floor) j["holdout_over_floor"] = *o.holdout_over_floor;
  for (const Recovered& r : o.recovered)
    j["recovered"].push_back({{"name", r.name}, {"shape", r.nonlinear}, {"error", r.error}, {"covered", r.covered}});
  return j;
}

Outcome from_json(const nlohmann::json& j) {
  Outcome o;
  o.what = {j.at("hidden"), j.at("scale"), j.at("seed"), j.at("friction_variation"), j.at("noise_correlation"),
            j.at("with")};
  o.named = j.at("named");
  o.verdict = j.at("verdict");
  o.right = j.at("right");
  o.found_all = j.at("found_all");
  o.missing_over_noise = j.at("missing_over_noise");
  o.best_score = j.at("best_score");
  o.seconds = j.at("seconds");
  o.detail = j.at("detail");
  if (j.contains("holdout_over_floor")) o.holdout_over_floor = j.at("holdout_over_floor").get<double>();
  for (const auto& r : j.at("recovered"))
    o.recovered.push_back({r.at("name"), r.at("shape"), r.at("error"), r.at("covered")});
  return o;
}

}  // namespace

std::vector<Case> test_round(std::uint64_t round) {
  std::vector<Case> cases;
  const std::uint64_t seed = kFirstTestSeed + 100 * round;
  // Nothing hidden, with the four kinds of data that have led to false names.
  for (std::uint64_t s = 0; s < kNothingOfAKind; ++s)
    for (const double variation : kVariations)
      for (const double correlation : {0.0, kCorrelation})
        cases.push_back({"", 1.0, seed + 10 + s, variation, correlation, ""});
  for (std::size_t h = 0; h < kHidden.size(); ++h)
    cases.push_back({kHidden[h], kScales[(round + h) % std::size(kScales)], seed + 20 + h,
                     kVariations[(round / std::size(kScales) + h + 1) % std::size(kVariations)], 0.0, ""});
  // The n-th of a list that continues from round to round; its second pass has the other friction variation.
  const auto nth = [&](const std::vector<std::string>& list, std::size_t n, std::uint64_t own) {
    cases.push_back(
        {list[n % list.size()], 1.0, own, kVariations[(n + n / list.size()) % std::size(kVariations)], 0.0, ""});
  };
  for (std::size_t k = 0; k < kWholeInARound; ++k) nth(kWholeRecord, kWholeInARound * round + k, seed + 55 + k);
  for (std::size_t k = 0; k < kPairsInARound; ++k) nth(kPairs, kPairsInARound * round + k, seed + 60 + k);
  for (std::size_t k = 0; k < kUnknownInARound; ++k) nth(kUnknown, kUnknownInARound * round + k, seed + 70 + k);
  return cases;
}

std::vector<Case> calibration_round(std::uint64_t round) {
  std::vector<Case> cases;
  // Every third drive has more friction laws in it and in the model.
  const std::string with = round % 3 == 2 ? "stribeck_gaussian,gravity,torque_ripple:2" : "";
  std::uint64_t seed = kFirstTuningSeed + 4 * round;
  for (const double variation : kVariations)
    for (const double correlation : {0.0, kCorrelation})
      if (seed <= kLastTuningSeed) cases.push_back({"", 1.0, seed++, variation, correlation, with});
  return cases;
}

Results::Results(std::filesystem::path file, const std::string& version) : file_(std::move(file)) {
  std::filesystem::create_directories(file_.parent_path());
  const std::string header = nlohmann::json{{"version", version}}.dump();
  std::ifstream in(file_);
  std::string line;
  if (std::getline(in, line) && line != header) {
    in.close();
    std::filesystem::rename(file_, file_.string() + ".old");
  } else {
    while (std::getline(in, line)) {
      // The last line may be incomplete if the campaign was stopped.
      const auto parsed = nlohmann::json::parse(line, nullptr, false);
      if (!parsed.is_discarded()) outcomes_.push_back(from_json(parsed));
    }
  }
  if (!std::filesystem::exists(file_)) std::ofstream(file_) << header << '\n';
}

bool Results::has(const Case& what) const {
  return std::any_of(outcomes_.begin(), outcomes_.end(), [&](const Outcome& o) { return o.what.key() == what.key(); });
}

void Results::add(const Outcome& outcome) {
  outcomes_.push_back(outcome);
  std::ofstream(file_, std::ios::app) << to_json(outcome).dump() << '\n';
}

}  // namespace flexspline::soak
