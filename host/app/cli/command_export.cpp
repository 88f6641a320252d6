#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/common/text/build_identity.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/interchange/export.hpp"
#include "host/output/interchange/protocol_header.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;

struct ExportOptions {
  std::filesystem::path model;
  std::string as;                // "c", "csv", "mujoco", "urdf"
  std::filesystem::path out;     // empty: standard output, or the model's name for the folder of tables
  bool protocol_header = false;  // then without a model
  std::string json;
};

// Into --out, else onto standard output.
void put_text(const ExportOptions& options, const std::string& text, json& files, Console& console) {
  if (!options.out.empty()) {
    model::save(options.out, text);
    console.line(fmt::format("{}: {} bytes", options.out.string(), text.size()));
    files.push_back(options.out.string());
  } else if (options.json == "-") {
    throw UsageError("the file and the answer cannot both go to standard output; give --out FILE");
  } else {
    fmt::print("{}", text);
  }
}

int run(const ExportOptions& options, Console& console) {
  if (options.protocol_header) {
    if (!options.model.empty() || !options.as.empty())
      throw UsageError("--protocol-header is of every drive; leave out --model and --as");
    json files = json::array();
    put_text(options, interchange::protocol_header(text::tool_name()), files, console);
    output::save_json(
        options.json,
        {{"format", "flexspline-export/1"}, {"as", "protocol-header"}, {"model", nullptr}, {"files", files}});
    return kDone;
  }
  if (options.model.empty() || options.as.empty())
    throw UsageError("give --model MODEL and --as c, csv, mujoco or urdf; or --protocol-header");
  const model::Model model = load_identified_model(options.model);
  if (model.effects.empty())
    throw interchange::ExportError(
        fmt::format("{}: the model has no effects, so there is nothing to write", options.model.string()));
  const std::string source = options.model.filename().string();
  json files = json::array();
  if (options.as == "csv") {
    if (options.out.empty()) throw UsageError("tables are several files; give --out DIR");
    const auto tables = interchange::csv_tables(model);
    make_folder(options.out);
    for (const auto& [name, text] : tables) {
      model::save(options.out / name, text);
      console.line((options.out / name).string());
      files.push_back((options.out / name).string());
    }
  } else {
    const std::string text = options.as == "c"        ? interchange::c_header(model, source)
                             : options.as == "mujoco" ? interchange::mujoco(model, source)
                                                      : interchange::urdf(model, source);
    put_text(options, text, files, console);
  }
  json answer = {{"format", "flexspline-export/1"}, {"as", options.as}, {"model", model.name}, {"files", files}};
  if (options.as == "mujoco" || options.as == "urdf") {
    const interchange::Joint joint = interchange::joint_of(model);
    const bool linear = model.drive.axis == data::Axis::linear;
    const auto quantity = [&](const char* name, double value, const char* rotary, const char* linear_law) {
      return json{{"name", name}, {"value", output::json_number(value)}, {"unit", linear ? linear_law : rotary}};
    };
    answer["joint"] = {quantity("armature", joint.armature, "kg*m^2", "kg"),
                       quantity("damping", joint.damping, "N*m*s/rad", "N*s/m"),
                       quantity("friction", joint.friction, "N*m", "N"),
                       quantity("friction_error", joint.friction_error, "N*m", "N"),
                       quantity("stiffness", joint.stiffness, "N*m/rad", "N/m"),
                       quantity("link_damping", joint.link_damping, "N*m*s/rad", "N*s/m")};
    answer["left_out"] = joint.left_out;
  }
  output::save_json(options.json, answer);
  return kDone;
}

void declare(Parser& parser, ExportOptions& options) {
  parser.option("--model", options.model, "model file").value("MODEL");
  parser.flag("--protocol-header", options.protocol_header,
              "no model, but messages and parameter block of a drive as a C header");
  parser.option("--as", options.as, "c: a C header; csv: tables; mujoco, urdf: a joint for a physics engine")
      .one_of({"c", "csv", "mujoco", "urdf"})
      .value("");
  parser.option("--out", options.out, "the file, or the folder of tables (default: print; csv needs it)").value("PATH");
}

}  // namespace

Command export_command() {
  return command<ExportOptions>(
      {"export",
       "the model for other tools: C header, tables, MuJoCo, URDF",
       "c: one C99 header with all the model's effects, those with memory too, to be called once a sample; its "
       "numbers are those of simulate, to rounding. csv: a folder with the parameters, the friction over speed, the "
       "transmission's loop, and the curve of each effect that depends on one signal. mujoco, urdf: a joint with "
       "armature, the linear law nearest to the friction, and stiffness; what a joint cannot hold is written in a "
       "comment. --protocol-header writes what travels between host and drive, for programs of your own: message "
       "kinds, codes, channels, layouts, and the parameter block with the places of its fields.",
       {kMakeData, kIdentify, "flexspline export --protocol-header --out flexspline_protocol.h",
        "flexspline export --model fitted.toml --as c --out drive_model.h",
        "flexspline export --model fitted.toml --as csv --out tables"}},
      declare, run);
}

}  // namespace flexspline::cli
