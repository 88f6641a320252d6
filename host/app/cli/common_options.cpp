#include "host/app/cli/common_options.hpp"

#include <fmt/format.h>

#include "host/drive_link/transport/link.hpp"
#include "host/input/data/findings.hpp"

namespace flexspline::cli {

void take_data(Parser& parser, DataInputs& inputs) {
  parser.option("DATA", inputs.data, kDataHelp).required().value("");
  take_tolerate(parser, inputs.tolerate);
}

void take_tolerate(Parser& parser, std::vector<std::string>& kinds) {
  parser.option("--tolerate", kinds, fmt::format("treat a finding as a warning; kinds: {}", data::tolerable_kinds()))
      .value("KIND")
      .comma_separated()
      .one_value_each_time();
}

void take_holdout(Parser& parser, DataInputs& inputs) {
  parser.option("--holdout", inputs.holdout, "measurements for validation, never fitted, whatever role they state")
      .value("DATA");
}

void take_model(Parser& parser, std::filesystem::path& model) {
  parser.option("--model", model, "model file").required().value("MODEL");
}

void take_pipeline(Parser& parser, PipelineInputs& pipeline) {
  parser.option("--cutoff-hz", pipeline.cutoff_hz, "cut-off of both filters (default: chosen from the data)")
      .value("HZ");
  parser.option("--mask", pipeline.mask, "auto leaves out reversals and sticking, none keeps them (default: auto)")
      .one_of({"auto", "none"})
      .value("");
  parser
      .option("--derivatives", pipeline.derivatives,
              "of positions: butterworth filters and differentiates them, kalman smooths them (Rauch, Tung and "
              "Striebel) with the most likely covariances (default: butterworth)")
      .one_of({"butterworth", "kalman"})
      .value("");
}

void take_report(Parser& parser, std::filesystem::path& report) {
  parser.option("--report", report, "write a page with plots for a browser or a printer (HTML, all in one file)")
      .value("FILE");
}

void take_drive(Parser& parser, std::string& drive) {
  parser.option("--drive", drive, fmt::format("{} (default: the only one on USB)", transport::kDriveHelp))
      .value("DRIVE");
}

void take_pairing_key(Parser& parser, std::filesystem::path& key) {
  parser.option("--pairing-key", key, "file of the key that a drive is paired with (flexspline pair)").value("KEY");
}

void take_yes(Parser& parser, bool& yes) {
  parser.flag("--yes", yes, "do not ask for confirmation");
}

}  // namespace flexspline::cli
