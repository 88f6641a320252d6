#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <utility>

#include "host/common/text/nearest.hpp"
#include "host/common/text/toml.hpp"
#include "host/engine/planning/plan.hpp"
#include "host/physics/model/text.hpp"

namespace flexspline::planning {
namespace {

using text::Node;
using text::NodeKind;

constexpr std::string_view kFormat = "flexspline-plan/1";

constexpr std::pair<std::string_view, Mode> kModes[] = {
    {"off", Mode::off}, {"current", Mode::current}, {"velocity", Mode::velocity}, {"position", Mode::position}};
constexpr std::pair<std::string_view, Waveform> kWaveforms[] = {{"zero", Waveform::zero},
                                                                {"sine", Waveform::sine},
                                                                {"inverted_sine", Waveform::inverted_sine},
                                                                {"composite", Waveform::composite},
                                                                {"multi_sine", Waveform::multi_sine},
                                                                {"asymmetric_sine", Waveform::asymmetric_sine},
                                                                {"square", Waveform::square},
                                                                {"saw_tooth", Waveform::saw_tooth},
                                                                {"triangle", Waveform::triangle}};

std::string number(double value) {
  return model::number_text(value, 6);
}

// Of a key's number, for messages.
std::string_view unit_of(std::string_view key) {
  constexpr std::pair<std::string_view, std::string_view> kEnds[] = {{"_rad_s", "in rad/s (linear axis: m/s)"},
                                                                     {"_hz", "in Hz"},
                                                                     {"_nm", "in N*m (linear axis: N)"},
                                                                     {"_rad", "in rad (linear axis: m)"},
                                                                     {"_s", "in s"},
                                                                     {"_a", "in A"},
                                                                     {"_c", "in degC"}};
  for (const auto& [end, unit] : kEnds)
    if (key.ends_with(end)) return unit;
  if (key == "slope_limit") return "in the unit of the amplitude per second";
  if (key == "amplitude" || key == "offset")
    return "in A (mode current), rad/s (velocity) or rad (position) at the motor; on a linear axis m/s or m";
  return "as the plan's description states";
}

// A table of the file, whose keys are taken one after another; an unread key is unknown.
class Section {
 public:
  Section(const Node& node, std::string_view origin, std::string where)
      : node_(node), origin_(origin), where_(std::move(where)) {}

  [[noreturn]] void fail(std::size_t line, const std::string& what) const {
    throw PlanError(fmt::format("{}:{}: {}: {}", origin_, line, where_, what));
  }
  const Node* find(std::string_view key, NodeKind kind, std::string_view expected) {
    known_.emplace_back(key);
    const Node* found = node_.find(key);
    if (found && found->kind != kind) fail(found->line, fmt::format("{} must be {}", key, expected));
    return found;
  }
  std::optional<double> number(std::string_view key) {
    const Node* found = find(key, NodeKind::number, "a number alone, " + std::string(unit_of(key)));
    if (!found) return std::nullopt;
    if (!std::isfinite(found->number)) fail(found->line, fmt::format("{} must be finite", key));
    return found->number;
  }
  double number(std::string_view key, double otherwise, double least = -1e300) {
    const double value = number(key).value_or(otherwise);
    if (value < least) fail(node_.find(key)->line, fmt::format("{} must be at least {}", key, least));
    return value;
  }
  std::string text(std::string_view key) {
    const Node* found = find(key, NodeKind::text, "text");
    return found ? found->text : std::string();
  }
  template <class T, std::size_t N>
  T choice(std::string_view key, const std::pair<std::string_view, T> (&names)[N], T otherwise) {
    const Node* found = find(key, NodeKind::text, "text");
    if (!found) return otherwise;
    std::vector<std::string_view> all;
    for (const auto& [name, value] : names) {
      if (name == found->text) return value;
      all.push_back(name);
    }
    fail(found->line, fmt::format("{} = \"{}\" is unknown; use one of {}", key, found->text, fmt::join(all, ", ")));
  }
  void done() const {
    for (const text::Entry& e : node_.entries)
      if (std::find(known_.begin(), known_.end(), e.key) == known_.end()) fail(e.line, unknown(e.key));
  }
  // A key with another unit at its end (frequency_rpm) is that one with its own.
  std::string unknown(std::string_view key) const {
    std::string meant = text::nearest(key, known_);
    const auto stem = [](std::string_view k) { return k.substr(0, k.find('_')); };
    for (const std::string_view known : known_)
      if (meant.empty() && stem(known) == stem(key)) meant = known;
    if (meant.empty()) return fmt::format("unknown key \"{}\"; take it out or correct its spelling", key);
    return fmt::format("unknown key \"{}\"; did you mean {}, {}?", key, meant, unit_of(meant));
  }
  std::size_t line() const { return node_.line; }

 private:
  const Node& node_;
  std::string_view origin_;
  std::string where_;
  std::vector<std::string_view> known_;
};

std::vector<Line> lines_of(Section& section) {
  std::vector<Line> lines;
  const Node* list = section.find("lines", NodeKind::array, "a list of [harmonic, phase in turns, weight]");
  if (!list) return lines;
  for (const Node& item : list->items) {
    const bool good =
        item.kind == NodeKind::array && item.items.size() == 3 &&
        std::all_of(item.items.begin(), item.items.end(),
                    [](const Node& n) { return n.kind == NodeKind::number && std::isfinite(n.number); }) &&
        item.items[0].number >= 1.0 && item.items[0].number <= 65535.0 &&
        item.items[0].number == std::floor(item.items[0].number);
    if (!good) section.fail(item.line, "a line is [harmonic, phase in turns, weight], as [3, 0.25, 1.0]");
    lines.push_back({static_cast<int>(item.items[0].number), item.items[1].number, item.items[2].number});
  }
  return lines;
}

// Half a day at a thousand samples a second: what is longer was meant in another unit.
constexpr double kMostSamples = 5e7;

Run run_of(const Node& node, std::string_view origin, double sample_s) {
  Section section(node, origin, "[[run]]");
  Run run;
  run.name = section.text("name");
  if (run.name.empty() || run.name.find_first_of("/\\\"\n") != std::string::npos)
    section.fail(node.line, "a name becomes a file name: it must be there and hold no slashes or quotes");
  run.mode = section.choice("mode", kModes, run.mode);
  run.waveform = section.choice("waveform", kWaveforms, run.waveform);
  run.amplitude = section.number("amplitude", 0.0, 0.0);
  run.offset = section.number("offset", 0.0);
  run.frequency_hz = section.number("frequency_hz", 0.0, 0.0);
  run.end_frequency_hz = section.number("end_frequency_hz");
  run.lines = lines_of(section);
  run.slope_limit = section.number("slope_limit");
  run.duration_s = section.number("duration_s", run.duration_s, 0.0);
  if (!(run.duration_s > 0.0)) section.fail(node.line, "duration_s must be positive");
  if (run.duration_s > kMostSamples * sample_s)
    section.fail(node.line, fmt::format("duration_s is {:g}, with a sample each {:g} s more than {:g} samples; make it "
                                        "shorter, or several runs of it",
                                        run.duration_s, sample_s, kMostSamples));
  if (run.slope_limit && !(*run.slope_limit > 0.0)) section.fail(node.line, "slope_limit must be positive");
  constexpr std::pair<std::string_view, bool> kLoads[] = {{"free", false}, {"locked", true}};
  run.locked = section.choice("load", kLoads, false);
  run.load_torque_nm = section.number("load_torque_nm", 0.0);
  run.temperature_c = section.number("temperature_c");
  run.instructions = section.text("instructions");
  section.done();
  if (run.waveform == Waveform::multi_sine && run.lines.empty())
    section.fail(node.line, "a multi_sine needs lines = [[harmonic, phase in turns, weight], ...]");
  return run;
}

}  // namespace

std::string_view name_of(Mode mode) {
  for (const auto& [name, value] : kModes)
    if (value == mode) return name;
  return "";
}

std::string_view name_of(Waveform waveform) {
  for (const auto& [name, value] : kWaveforms)
    if (value == waveform) return name;
  return "";
}

std::string text_of(const Plan& plan) {
  std::string text =
      fmt::format("# Motions to record, by flexspline plan. `flexspline-hil record --plan` runs them on the twin.\n");
  for (const std::string& note : plan.notes) text += fmt::format("# {}\n", note);
  text += fmt::format("format = \"{}\"\nmodel = {}\nsample_s = {}\n", kFormat, model::toml_string(plan.model),
                      number(plan.sample_s));
  if (!plan.separate.empty()) {
    text += "separate = [";
    for (std::size_t i = 0; i < plan.separate.size(); ++i)
      text += fmt::format("{}{}", i ? ", " : "", model::toml_string(plan.separate[i]));
    text += "]\n";
  }
  text += fmt::format(
      "\n[limits]                # not to be exceeded whatever a run states\ncurrent_a = {}\nvelocity_rad_s = {}\n"
      "travel_rad = {}\nduration_s = {}\nload_torque_nm = {}\n",
      number(plan.limits.current_a), number(plan.limits.velocity_rad_s), number(plan.limits.travel_rad),
      number(plan.limits.duration_s), number(plan.limits.load_torque_nm));
  for (const Run& run : plan.runs) {
    text += fmt::format("\n[[run]]\nname = {}\n", model::toml_string(run.name));
    if (!run.instructions.empty()) text += fmt::format("instructions = {}\n", model::toml_string(run.instructions));
    text += fmt::format("mode = \"{}\"\nwaveform = \"{}\"\n", name_of(run.mode), name_of(run.waveform));
    if (run.mode != Mode::off)
      text += fmt::format("amplitude = {}\noffset = {}\nfrequency_hz = {}\n", number(run.amplitude), number(run.offset),
                          number(run.frequency_hz));
    if (run.end_frequency_hz) text += fmt::format("end_frequency_hz = {}\n", number(*run.end_frequency_hz));
    if (!run.lines.empty()) {
      text += "lines = [               # harmonic, phase in turns, weight\n";
      for (const Line& line : run.lines)
        text += fmt::format("  [{}, {}, {}],\n", line.harmonic, model::number_text(line.phase_turns, 10),
                            number(line.weight));
      text += "]\n";
    }
    if (run.slope_limit) text += fmt::format("slope_limit = {}\n", number(*run.slope_limit));
    text += fmt::format("duration_s = {}\nload = \"{}\"\n", number(run.duration_s), run.locked ? "locked" : "free");
    if (run.load_torque_nm != 0.0) text += fmt::format("load_torque_nm = {}\n", number(run.load_torque_nm));
    if (run.temperature_c) text += fmt::format("temperature_c = {}\n", number(*run.temperature_c));
  }
  return text;
}

Plan parse(const std::string& text, std::string_view origin) {
  Node root;
  try {
    root = text::parse_toml(text);
  } catch (const text::TomlError& error) {
    throw PlanError(fmt::format("{}:{}: {}; {}", origin, error.line(), error.what(), error.remedy()));
  }
  Section top(root, origin, "plan");
  Plan plan;
  if (top.text("format") != kFormat) top.fail(root.line, fmt::format("format must be \"{}\"", kFormat));
  plan.model = top.text("model");
  plan.sample_s = top.number("sample_s", plan.sample_s, 0.0);
  if (!(plan.sample_s > 0.0)) top.fail(root.line, "sample_s must be positive");
  if (const Node* names = top.find("separate", NodeKind::array, "a list of two effects"))
    for (const Node& name : names->items) plan.separate.push_back(name.text);
  if (const Node* limits = top.find("limits", NodeKind::table, "a table")) {
    Section section(*limits, origin, "[limits]");
    plan.limits.current_a = section.number("current_a", 0.0, 0.0);
    plan.limits.velocity_rad_s = section.number("velocity_rad_s", 0.0, 0.0);
    plan.limits.travel_rad = section.number("travel_rad", 0.0, 0.0);
    plan.limits.duration_s = section.number("duration_s", 0.0, 0.0);
    plan.limits.load_torque_nm = section.number("load_torque_nm", 0.0, 0.0);
    section.done();
  }
  if (const Node* runs = top.find("run", NodeKind::array, "written as [[run]]"))
    for (const Node& run : runs->items) plan.runs.push_back(run_of(run, origin, plan.sample_s));
  top.done();
  return plan;
}

Plan read(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw PlanError(fmt::format("{}: cannot be read; check the path of the plan", file.string()));
  std::ostringstream text;
  text << in.rdbuf();
  return parse(text.str(), file.string());
}

}  // namespace flexspline::planning
