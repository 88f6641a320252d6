#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/engine/measurement/derivatives.hpp"
#include "host/output/answers/derivatives.hpp"
#include "host/output/answers/json.hpp"
#include "host/physics/model/model.hpp"

namespace flexspline::cli {
namespace {

struct DerivativesOptions {
  DataInputs data;
  std::string side;  // "motor", "output"; empty: both
  std::optional<double> cutoff_hz;
  std::filesystem::path picture;  // empty: none
  std::optional<double> from_s, to_s;
  std::string json;
};

// A few periods of the cut-off in the middle of the record, where nothing else was asked for.
void draw(const DerivativesOptions& options, const measurement::DerivativeComparison& c, data::Axis axis) {
  constexpr double kPeriods = 10.0;
  const double middle = 0.5 * (c.time_s.front() + c.time_s.back());
  const double from = options.from_s.value_or(middle);
  const double to = options.to_s.value_or(from + std::max(kPeriods / c.cutoff_hz, 20.0 * c.sample_s));
  model::save(options.picture, output::derivatives_picture(c, axis, from, to));
}

int run(const DerivativesOptions& options, Console& console) {
  const data::Dataset dataset = load(options.data, console);
  console.progress("differentiating");
  measurement::DerivativeOptions wanted;
  wanted.motor = options.side != "output";
  wanted.output = options.side != "motor";
  wanted.cutoff_hz = options.cutoff_hz;
  const std::vector<measurement::DerivativeComparison> found = measurement::compare_derivatives(dataset, wanted);
  const data::Axis axis = dataset.drive.axis.value_or(data::Axis::rotary);
  console.line(output::derivatives_text(found, axis));
  if (!options.picture.empty()) {
    draw(options, found.front(), axis);
    console.line(
        fmt::format("  {} shows {} of {}.", options.picture.string(), found.front().column, found.front().experiment));
  }
  output::save_json(options.json, output::derivatives_json(found, axis));
  return kDone;
}

void declare(Parser& parser, DerivativesOptions& options) {
  take_data(parser, options.data);
  parser.option("--side", options.side, "whose position: motor or output (default: both)")
      .one_of({"motor", "output"})
      .value("");
  parser
      .option("--cutoff-hz", options.cutoff_hz, "of all filters that have one (default: as identify filters positions)")
      .positive()
      .value("HZ");
  parser.option("--picture", options.picture, "draw velocity and acceleration by some of them (SVG)").value("FILE");
  parser.option("--from-s", options.from_s, "the picture's start (default: the middle of the first record)").value("S");
  parser.option("--to-s", options.to_s, "its end (default: after ten periods of the cut-off)").value("S");
}

}  // namespace

Command derivatives_command() {
  return command<DerivativesOptions>(
      {"derivatives",
       "velocity and acceleration from positions: ways to them, compared on the data",
       "Differentiates each position by the methods of section 1.3.4 of the report (differences, bilinear rule, the "
       "filters H1 and H2, each as it is made discrete), by the zero-phase Butterworth filter that identify uses, and "
       "by a Kalman filter with Rauch-Tung-Striebel smoothing. Shows what each keeps of the position's noise in "
       "velocity and acceleration, by how much it comes late, and how far it is from the reference: the measured "
       "velocity where there is one, else the smoother. The noise is that of the smoother's most likely covariances. "
       "identify --derivatives kalman uses the smoother.",
       {kMakeData, "flexspline derivatives demo-out --side motor --picture derivatives.svg"}},
      declare, run);
}

}  // namespace flexspline::cli
