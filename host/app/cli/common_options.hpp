// The options that several commands have.
#pragma once

#include <filesystem>
#include <string>

#include "host/app/cli/inputs.hpp"
#include "host/app/cli/parser.hpp"

namespace flexspline::cli {

inline constexpr const char* kDataHelp =
    "measurements: any number of recordings (CSV, MAT, HDF5, NumPy, ROS, MCAP), folders, dataset.tomls";

// DATA and --tolerate.
void take_data(Parser& parser, DataInputs& inputs);
void take_tolerate(Parser& parser, std::vector<std::string>& kinds);
void take_holdout(Parser& parser, DataInputs& inputs);
void take_model(Parser& parser, std::filesystem::path& model);
void take_pipeline(Parser& parser, PipelineInputs& pipeline);
void take_report(Parser& parser, std::filesystem::path& report);
void take_drive(Parser& parser, std::string& drive);
void take_pairing_key(Parser& parser, std::filesystem::path& key);
void take_yes(Parser& parser, bool& yes);

}  // namespace flexspline::cli
