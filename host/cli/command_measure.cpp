#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/measurement/measure.hpp"
#include "host/output/json.hpp"
#include "host/output/measurement.hpp"

namespace flexspline::cli {

int run(const MeasureOptions& options, Console& console) {
  const data::Dataset dataset = load(options.data, console);
  console.progress("averaging spectra");
  const measurement::Measurement found = measurement::measure(dataset, options.period_s);
  console.line(output::measurement_text(found));
  output::save_json(options.json, output::measurement_json(found));
  return kDone;
}

}  // namespace flexspline::cli
