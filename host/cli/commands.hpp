// The commands: what each is given, and what runs it. One file a command; the options come from app.cpp.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/cli/inputs.hpp"
#include "host/deployment/pack.hpp"
#include "host/selection/user_defined_effects.hpp"

namespace flexspline::cli {

struct DemoOptions {
  std::string hidden;  // empty: by chance; "none": nothing
  std::optional<std::uint64_t> seed;
  std::filesystem::path out = "demo-out";
  std::string json;
};
int run(const DemoOptions& options, Console& console);

struct EffectsOptions {
  std::string name;  // empty: all
  std::string json;
};
int run(const EffectsOptions& options, Console& console);

struct CheckOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::string json;
};
int run(const CheckOptions& options, Console& console);

struct MeasureOptions {
  DataInputs data;
  std::optional<double> period_s;  // else found in the data
  std::string json;
};
int run(const MeasureOptions& options, Console& console);

struct NewOptions {
  DataInputs data;
  std::filesystem::path out;
  std::vector<std::string> map;      // OURS=THEIRS[:UNIT]
  std::vector<std::string> without;  // columns of theirs that are not used, whatever their names say
  std::vector<std::string> turned;   // columns of ours whose sign is the other one
  std::string axis;                  // empty: guessed
  std::string position_side;         // "link", "motor"; empty: guessed
  std::optional<int> pole_pairs;
  std::optional<int> joint;  // of a file with several
  std::optional<double> gear_ratio;
  std::optional<double> torque_constant_nm_a;
  std::optional<double> encoder_counts;
  bool force = false;
  std::string json;
};
int run(const NewOptions& options, Console& console);

struct IdentifyOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::filesystem::path out;  // empty: print only
  std::string method;         // empty: what the model needs
  std::string intervals = "standard";
  std::vector<std::string> supply;  // EFFECT.PARAMETER=VALUE
  int starts = 3;
  std::uint64_t seed = 1;
  std::filesystem::path report;  // empty: none
  std::string json;
};
int run(const IdentifyOptions& options, Console& console);

struct SimulateOptions {
  DataInputs data;
  std::filesystem::path model;
  std::filesystem::path out;
  std::string json;
};
int run(const SimulateOptions& options, Console& console);

struct CompareOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::vector<std::string> limits;     // SIGNAL=RMSE
  std::vector<std::string> baselines;  // fir:20, arx:4,4,1
  std::filesystem::path report;        // empty: none
  std::string json;
};
int run(const CompareOptions& options, Console& console);

struct SensitivityOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  bool refit = false;
  std::vector<std::string> scale;  // EFFECT.PARAMETER=FACTOR
  std::string json;
};
int run(const SensitivityOptions& options, Console& console);

struct DiagnoseOptions {
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  bool all = false;              // --auto
  std::filesystem::path report;  // empty: none
  std::string json;
};
int run(const DiagnoseOptions& options, Console& console);

struct PlanOptions {
  DataInputs data;  // may be none
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::filesystem::path out;
  std::vector<std::string> separate;  // two effects, or none
  std::vector<std::string> without;   // off, locked, load, temperature
  std::vector<double> temperatures_c;
  std::optional<double> current_a, velocity_rad_s, travel_rad, duration_s, load_torque_nm, run_s, sample_hz;
  int motions = 4;
  std::string json;
};
int run(const PlanOptions& options, Console& console);

struct ChangeOptions {
  std::string effect;
  DataInputs data;
  PipelineInputs pipeline;
  std::filesystem::path model;
  std::filesystem::path out;
  std::filesystem::path report;  // empty: none
  std::string json;
};
struct AddOptions : ChangeOptions {
  selection::UserDefinition user_defined;
};
struct RemoveOptions : ChangeOptions {};
int run(const AddOptions& options, Console& console);
int run(const RemoveOptions& options, Console& console);

struct PackCommandOptions {
  std::filesystem::path model;
  std::filesystem::path out;
  std::filesystem::path drive;  // settings of the drive; empty: none in the block
  std::string for_drive;        // empty: no drive is read
  deployment::PackOptions pack;
  std::string json;
};
int run(const PackCommandOptions& options, Console& console);

struct UnpackOptions {
  std::filesystem::path block;
  std::filesystem::path out;  // empty: print only
  std::string json;
};
int run(const UnpackOptions& options, Console& console);

struct ExportOptions {
  std::filesystem::path model;
  std::string as;             // "c", "csv", "mujoco", "urdf"
  std::filesystem::path out;  // empty: standard output, or the model's name for the folder of tables
  std::string json;
};
int run(const ExportOptions& options, Console& console);

}  // namespace flexspline::cli
