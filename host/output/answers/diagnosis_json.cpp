// A diagnosis as JSON; the keys are in JSON.md.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/output/answers/diagnosis.hpp"
#include "host/output/answers/drive_words.hpp"
#include "host/output/answers/explanation.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/learned_table.hpp"
#include "host/physics/catalogue/catalogue.hpp"

namespace flexspline::output {
namespace {

using nlohmann::json;
using selection::Candidate;
using selection::Diagnosis;

json between_records_json(const selection::Diagnosis& d) {
  if (!d.between_records) return nullptr;
  return {{"records", d.between_records->records},
          {"explained_percent", d.between_records->explained_percent},
          {"p_value", d.between_records->p_value}};
}

json law_in_range_json(const selection::Diagnosis& d) {
  if (!d.law_in_range) return nullptr;
  const selection::LawInRange& law = *d.law_in_range;
  return {{"effects", law.effects},
          {"records", law.records},
          {"of_records", law.of_records},
          {"lowest_speed", law.lowest_speed},
          {"highest_speed", law.highest_speed},
          {"explained_percent", law.explained_percent},
          {"p_value", law.p_value},
          {"p_value_of_all", law.p_value_of_all}};
}

json unknown_json(const Diagnosis& d) {
  if (!d.unknown) return nullptr;
  const selection::UnknownStructure& u = *d.unknown;
  json answer = learned_table_json("unknown", u.definition, u.curve, d.unit);
  answer["effect"] = u.effect;
  answer["depends_on"] = json::array();
  for (const auto& over : u.depends_on)
    answer["depends_on"].push_back({{"variable", over.variable}, {"fall_percent", json_number(over.decrease_percent)}});
  answer["named_share_percent"] = json_number(u.named_share_percent);
  answer["record_next"] = u.record_next;
  return answer;
}

json localised_json(const std::vector<selection::LocalisedResidual>& parts) {
  json list = json::array();
  for (const selection::LocalisedResidual& part : parts)
    list.push_back({{"variable", part.variable}, {"share_percent", json_number(part.share_percent)}});
  return list;
}

json drift_json(const std::vector<selection::Drift>& drifts) {
  json list = json::array();
  for (const selection::Drift& drift : drifts)
    list.push_back({{"group", drift.group}, {"percent", json_number(drift.percent)}});
  return list;
}

json trends_json(const std::vector<selection::Trend>& trends) {
  json list = json::array();
  for (const selection::Trend& t : trends)
    list.push_back({{"id", t.id},
                    {"parameter", t.parameter},
                    {"over", t.over},
                    {"slope", json_number(t.slope)},
                    {"p_value", json_number(t.p_value)}});
  return list;
}

json named_json(const std::vector<selection::NamedEffect>& named) {
  json list = json::array();
  for (const selection::NamedEffect& n : named) list.push_back({{"effect", n.effect}, {"order", json_number(n.order)}});
  return list;
}

json stated_setting_json(const selection::Diagnosis& d) {
  if (!d.at_stated_setting) return nullptr;
  return {{"verdict", selection::verdict_name(d.at_stated_setting->verdict)},
          {"named", named_json(d.at_stated_setting->named)}};
}

json candidate_json(const Candidate& c, std::size_t rank, const std::string& unit) {
  json parameters = json::array();
  for (const estimation::Estimate& e : c.parameters) parameters.push_back(json_parameter(e));
  const catalogue::Entry* entry = catalogue::find(c.effect);
  const auto text = [&](std::string_view effects::Description::*field) {
    return entry ? json(words_on(axis_of(unit), entry->info->*field)) : json(nullptr);
  };
  return {{"effect", c.effect},
          {"order", json_number(c.order)},
          {"balance", catalogue::balance_name(c.balance)},
          {"rank", rank},
          {"score", json_number(c.score)},
          {"score_elsewhere", json_number(c.other_balance_score)},
          {"chi2_fall_percent", json_number(c.chi2_decrease_percent)},
          {"rmse_cv_before", json_number(c.rmse_cv_before)},
          {"rmse_cv_after", json_number(c.rmse_cv_after)},
          {"unit", unit},
          {"p_value", json_number(c.p_value)},
          {"parameters", std::move(parameters)},
          {"minimum_detectable", detectable_json(c)},
          {"admissible", c.admissible},
          {"why_not", c.admissible ? json(nullptr) : json(c.why_not)},
          {"note", c.note.empty() ? json(nullptr) : json(c.note)},
          {"rivals", c.cannot_distinguish},
          {"rival_reasons", confounding_reasons_json(c)},
          {"evidence", evidence_json(c, unit)},
          {"size", size_json(c, unit)},
          {"separating_experiment", text(&effects::Description::separated_by)},
          {"explanation", text(&effects::Description::explanation)},
          {"consequence", text(&effects::Description::consequence)},
          {"causes", text(&effects::Description::causes)},
          {"check", text(&effects::Description::check)},
          {"order_causes", order_causes_json(c)},
          {"order_hint", c.order_hint.empty() ? json(nullptr) : json(c.order_hint)}};
}

json noise_of_some_json(const Diagnosis& d) {
  if (!d.noise_of_some) return nullptr;
  return {{"experiments", d.noise_of_some->records},
          {"rmse", json_number(d.noise_of_some->rmse)},
          {"noise_floor", json_number(d.noise_of_some->noise)},
          {"noise_floor_from", d.noise_of_some->from}};
}

json possible_json(const std::vector<selection::PossibleEffect>& possible) {
  json list = json::array();
  for (const selection::PossibleEffect& one : possible)
    list.push_back({{"effects", named_json(one.group)},
                    {"frequency", json_number(one.frequency)},
                    {"held_out_ratio", json_number(one.held_out_ratio)},
                    {"why_not", one.why_not}});
  return list;
}

json resampling_json(const Diagnosis& d) {
  if (!d.resampling) return nullptr;
  json found = json::array();
  for (const selection::Resampling::FoundTerm& f : d.resampling->found)
    found.push_back({{"effects", named_json(f.group)},
                     {"structure", f.group.empty() ? json(f.name) : json(nullptr)},
                     {"frequency", json_number(f.frequency)},
                     {"share_percent", json_number(f.share_percent)},
                     {"share_low_percent", json_number(f.share_low_percent)},
                     {"share_high_percent", json_number(f.share_high_percent)},
                     {"held_out_ratio", json_number(f.held_out_ratio)},
                     {"refused_by_holdout", f.refused_by_holdout}});
  return {{"subsamples", d.resampling->subsamples},
          {"abstained", d.resampling->abstained},
          {"too_little", d.resampling->too_little},
          {"whiteness", json_number(d.resampling->von_neumann_ratio)},
          {"lowest_hz", json_number(d.resampling->lowest_hz)},
          {"highest_hz", json_number(d.resampling->highest_hz)},
          {"lag_s", json_number(d.resampling->lag_s)},
          {"lag_std_s", json_number(d.resampling->lag_std_s)},
          {"decides", d.resampling->decides},
          {"found", std::move(found)}};
}

}  // namespace

json diagnosis_json(const Diagnosis& d) {
  json candidates = json::array();
  for (const Candidate& c : d.candidates) candidates.push_back(candidate_json(c, candidates.size() + 1, d.unit));
  json disturbances = json::array();
  for (const selection::Disturbance& x : d.disturbances)
    disturbances.push_back({{"experiment", x.experiment},
                            {"from_s", json_number(x.from_s)},
                            {"to_s", json_number(x.to_s)},
                            {"peak", json_number(x.peak)},
                            {"unit", x.unit}});
  return {{"format", "flexspline-diagnose/1"},
          {"verdict", selection::verdict_name(d.verdict)},
          {"named", named_json(d.named)},
          {"balance", d.balance ? json(catalogue::balance_name(*d.balance)) : json(nullptr)},
          {"base",
           {{"rmse", json_number(d.base_rmse)},
            {"rmse_cv", json_number(d.base_rmse_cv)},
            {"rmse_own_friction", json_number(d.base_rmse_own_friction)},
            {"noise_floor", json_number(d.noise_floor)},
            {"noise_floor_from", d.noise_floor_from},
            {"noise_of_some", noise_of_some_json(d)},
            {"unit", d.unit}}},
          {"localised", localised_json(d.localised)},
          {"candidates", std::move(candidates)},
          {"parameter_trends", trends_json(d.parameter_trends)},
          {"friction_drift", drift_json(d.friction_drift)},
          {"remaining_structure", localised_json(d.remaining_structure)},
          {"recovered_percent", json_number(d.recovered_percent)},
          {"disturbances", std::move(disturbances)},
          {"partial", d.partial},
          {"possible", possible_json(d.possible)},
          {"between_records", between_records_json(d)},
          {"law_in_range", law_in_range_json(d)},
          {"resampling", resampling_json(d)},
          {"unknown", unknown_json(d)},
          {"delay_s", json_number(d.delay_s)},
          {"delay_advice", d.delay_advice.empty() ? json(nullptr) : json(d.delay_advice)},
          {"untried_advice", d.untried_advice.empty() ? json(nullptr) : json(d.untried_advice)},
          {"at_stated_setting", stated_setting_json(d)},
          {"warnings", d.warnings},
          {"rounds", json::array()}};
}

json rounds_json(const std::vector<Diagnosis>& rounds, const std::vector<selection::NamedEffect>& kept) {
  json result = diagnosis_json(rounds.front());
  for (const Diagnosis& d : rounds) result["rounds"].push_back(diagnosis_json(d));
  if (rounds.size() == 1) return result;
  result["named"] = named_json(kept);
  // The first round's verdict is of an effect that was removed again.
  if (kept.empty()) result["verdict"] = result["rounds"].back()["verdict"];
  return result;
}

}  // namespace flexspline::output
