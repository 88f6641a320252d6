#include <algorithm>

#include "hil/plant/parameters.hpp"
#include "hil/plant/toml_section.hpp"

namespace flexspline::plant {
namespace {

std::vector<Line> read_lines(const Section& section, const toml::node& node) {
  std::vector<Line> lines;
  const toml::array* list = node.as_array();
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    const toml::array* line = list->get(i)->as_array();
    if (line == nullptr || line->size() != 3)
      section.fail(list->get(i), "a line is [harmonic, phase in turns, weight]");
    const auto harmonic = line->get(0)->value<int>();
    const auto phase = line->get(1)->value<double>(), weight = line->get(2)->value<double>();
    if (!harmonic || !phase || !weight || *harmonic < 1)
      section.fail(line, "a line is [harmonic, phase in turns, weight]");
    lines.push_back({*harmonic, *phase, *weight});
  }
  return lines;
}

ExperimentPlan read_run(const toml::table& table, std::string_view origin, const Drive& drive) {
  ExperimentPlan plan;
  plan.fades_out = true;
  plan.temperature_c = drive.temperature_reference_c;
  Section section(table, origin, "[[run]]");
  section.text("name", plan.name, true);
  if (plan.name.empty() || plan.name.find_first_of("/\\\"\n") != std::string::npos)
    section.fail(table.get("name"), "a name becomes a file name: it must not be empty or hold slashes or quotes");
  section.choice("mode", plan.mode, {{"off", Mode::off}, {"current", Mode::current}, {"velocity", Mode::velocity}});
  section.choice("waveform", plan.waveform,
                 {{"zero", Waveform::zero},
                  {"sine", Waveform::sine},
                  {"inverted_sine", Waveform::inverted_sine},
                  {"composite", Waveform::composite},
                  {"multi_sine", Waveform::multi_sine},
                  {"asymmetric_sine", Waveform::asymmetric_sine},
                  {"square", Waveform::square},
                  {"saw_tooth", Waveform::saw_tooth},
                  {"triangle", Waveform::triangle}});
  section.not_negative("amplitude", plan.amplitude);
  section.number("offset", plan.offset);
  section.not_negative("frequency_hz", plan.frequency_hz);
  section.number("end_frequency_hz", plan.end_frequency_hz);
  section.not_negative("slope_limit", plan.slope_limit);
  section.positive("duration_s", plan.duration_s);
  section.choice("load", plan.locked, {{"free", false}, {"locked", true}});
  section.number("load_torque_nm", plan.load_torque_nm);
  section.number("temperature_c", plan.temperature_c);
  std::string instructions;
  section.text("instructions", instructions);
  if (const toml::node* lines = section.node("lines")) plan.lines = read_lines(section, *lines);
  section.done();
  if (plan.waveform == Waveform::multi_sine && plan.lines.empty())
    section.fail(nullptr, "a multi_sine needs lines = [[harmonic, phase in turns, weight], ...]");
  return plan;
}

}  // namespace

std::vector<ExperimentPlan> load_plan(const std::filesystem::path& file, Drive& drive) {
  const std::string origin = file.string();
  const toml::table root = parse_ascii(text_of(file, "plan"), origin);
  Section top(root, origin, "plan");
  std::string text;
  top.text("format", text, true);
  if (text != "flexspline-plan/1") top.fail(root.get("format"), "format must be \"flexspline-plan/1\"");
  top.text("model", text);
  top.positive("sample_s", drive.sample_s);
  top.node("separate");
  top.node("run");
  if (const toml::table* limits = top.table("limits")) {
    Section section(*limits, origin, "[limits]");
    double current_a = 0.0, other = 0.0;
    section.not_negative("current_a", current_a);
    if (current_a > 0.0) drive.current_limit_a = std::min(drive.current_limit_a, current_a);
    for (const char* key : {"velocity_rad_s", "travel_rad", "duration_s", "load_torque_nm"})
      section.not_negative(key, other);
    section.done();
  }
  top.done();
  std::vector<ExperimentPlan> runs;
  for_each_table(root, "run", origin, [&](const toml::table& t) { runs.push_back(read_run(t, origin, drive)); });
  return runs;
}

}  // namespace flexspline::plant
