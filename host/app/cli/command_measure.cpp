#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/engine/measurement/measure.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/measurement.hpp"

namespace flexspline::cli {
namespace {

struct MeasureOptions {
  DataInputs data;
  std::optional<double> period_s;  // else found in the data
  std::string json;
};

int run(const MeasureOptions& options, Console& console) {
  const data::Dataset dataset = load(options.data, console);
  console.progress("averaging spectra");
  const measurement::Measurement found = measurement::measure(dataset, options.period_s);
  console.line(output::measurement_text(found));
  output::save_json(options.json, output::measurement_json(found));
  return kDone;
}

void declare(Parser& parser, MeasureOptions& options) {
  take_data(parser, options.data);
  parser.option("--period-s", options.period_s, "period of the excitation (default: found in the data)")
      .positive()
      .value("S");
}

}  // namespace

Command measure_command() {
  return command<MeasureOptions>(
      {"measure",
       "before any model: frequency response, noise floor, distortion, resonance",
       "Reports what measurements show of a drive without any model: the frequency response from the current to "
       "velocity, torque and torsion with its coherence and confidence band; resonances and anti-resonances with "
       "damping; the noise of each signal, from what differs between the periods of an excitation; odd and even "
       "nonlinear distortion, from the lines that a linear drive would leave empty. What the given motions cannot "
       "show is printed, with the motion that would show it. Best is an odd random-phase multisine with some odd "
       "lines left out, repeated six times.",
       {kMakeData, "flexspline measure demo-out"}},
      declare, run);
}

}  // namespace flexspline::cli
