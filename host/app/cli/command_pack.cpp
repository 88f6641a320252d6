#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/app/cli/command.hpp"
#include "host/app/cli/common_options.hpp"
#include "host/app/cli/drive_commands.hpp"
#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/maker.hpp"
#include "host/drive_link/drive/model_block.hpp"
#include "host/output/answers/json.hpp"
#include "host/output/answers/text.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/model/signature.hpp"

namespace flexspline::cli {
namespace {

using nlohmann::json;
using output::number;

struct PackCommandOptions {
  std::filesystem::path model;
  std::filesystem::path out;
  std::filesystem::path drive;  // settings of the drive; empty: none in the block
  std::string for_drive;        // empty: no drive is read
  deployment::PackOptions pack;
  std::string json;
};

struct UnpackOptions {
  std::filesystem::path block;
  std::filesystem::path out;  // empty: print only
  std::string json;
};

constexpr int kErrorDigits = 3;

std::string text_of(const model::Name& name) {
  return {name.begin(), std::find(name.begin(), name.end(), '\0')};
}

json json_of(const deployment::Packed& packed) {
  json proof = json::array();
  for (const auto& part : packed.proof) {
    json entry = {
        {"part", part.part}, {"kind", part.kind}, {"bound", output::json_number(part.bound)}, {"unit", part.unit}};
    if (part.observed) {
      entry["share_of_rated"] = output::json_number(*part.share_of_rated);
      entry["observed"] = output::json_number(*part.observed);
      entry["unproven"] = part.unproven.empty() ? json() : json(part.unproven);
    }
    proof.push_back(std::move(entry));
  }
  return {{"format", "flexspline-pack/1"},
          {"bytes", packed.bytes.size()},
          {"sha256", packed.sha256},
          {"max_error_nm", packed.max_error_nm},
          {"max_error_share_of_rated", packed.max_error_share_of_rated},
          {"worst_balance", packed.worst_balance},
          {"torque_scale", packed.torque_scale},
          {"error_is_proven", packed.error_is_proven},
          {"error_bound_share_of_rated", output::json_number(packed.error_bound_share_of_rated)},
          {"proof", proof}};
}

// The proven bound and the largest measured error, for each effect and for the sum.
void print_errors(const deployment::Packed& packed, Console& console) {
  console.line();
  console.line(
      console.bold(fmt::format("{:<32}{:>12}{:>16}{:>14}  {}", "error of", "at most", "of rated", "seen", "unit")));
  const auto bound = [](double x) { return std::isfinite(x) ? number(x, kErrorDigits) : std::string("not proven"); };
  for (const auto& part : packed.proof)
    if (part.observed)
      console.line(fmt::format("{:<32}{:>12}{:>16}{:>14}  {}", part.part, bound(part.bound),
                               bound(*part.share_of_rated), number(*part.observed, kErrorDigits), part.unit));
  for (const auto& part : packed.proof)
    if (!part.unproven.empty() && part.part.find("_balance") == std::string::npos)
      console.line(fmt::format("{}: not proven, as {}", part.part, part.unproven));
}

struct Named {
  const char* name;
  const char* unit;
  double value;
};
std::vector<Named> bases_of(const deployment::Unpacked& block) {
  const auto d = deployment::from_block(block.header.bases);
  const bool linear = block.header.axis == 1;
  const char* const torque = linear ? "N" : "N*m";
  const char* const velocity = linear ? "m/s" : "rad/s";
  const char* const acceleration = linear ? "m/s^2" : "rad/s^2";
  const char* const angle = linear ? "m" : "rad";
  return {{"torque", torque, d.torque_base},
          {"output_torque", torque, d.output_torque_base},
          {"velocity", velocity, d.velocity_base},
          {"output_velocity", velocity, d.output_velocity_base},
          {"acceleration", acceleration, d.acceleration_base},
          {"output_acceleration", acceleration, d.output_acceleration_base},
          {"angle", angle, d.angle_base},
          {"torsion", angle, d.torsion_base},
          {"torsion_rate", velocity, d.torsion_rate_base},
          {"temperature", "degC", d.temperature_base},
          {"current", "A", d.current_base},
          {"tick", "s", d.time_base}};
}
std::vector<Named> limits_of(const deployment::Unpacked& block) {
  const auto d = deployment::from_block(block.header.bases);
  const model::Limits& l = block.header.limits;
  const bool linear = block.header.axis == 1;
  const char* const torque = linear ? "N" : "N*m";
  const char* const velocity = linear ? "m/s" : "rad/s";
  const auto in = [](fixed::Value x, double base) { return std::ldexp(x.raw, -fixed::kValueBits) * base; };
  return {{"torque", torque, in(l.torque, d.torque_base)},
          {"load", torque, in(l.load, d.output_torque_base)},
          {"velocity", velocity, in(l.velocity, d.velocity_base)},
          {"overspeed", velocity, in(l.overspeed, d.velocity_base)},
          {"current", "A", in(l.current, d.current_base)},
          {"torsion", linear ? "m" : "rad", in(l.torsion, d.torsion_base)},
          {"direction_band", velocity, in(l.direction_band, d.velocity_base)}};
}

json settings_json(const deployment::Unpacked& block) {
  json list = json::array();
  for (const auto& q : block.settings)
    list.push_back({{"name", q.name}, {"value", output::json_number(q.value)}, {"unit", q.unit}});
  return list;
}

json json_of(const deployment::Unpacked& block) {
  const auto quantities = [](const std::vector<Named>& all) {
    json list = json::array();
    for (const Named& q : all) list.push_back({{"name", q.name}, {"value", q.value}, {"unit", q.unit}});
    return list;
  };
  json effects = json::array();
  for (const auto& effect : block.effects) {
    json coefficients = json::array();
    for (const auto& c : effect.coefficients) coefficients.push_back({{"kind", c.kind}, {"value", c.value}});
    effects.push_back({{"effect", effect.type}, {"coefficients", coefficients}});
  }
  json parameters = json::array();
  if (block.model)
    for (const model::Effect& effect : block.model->effects)
      for (const model::Parameter& p : effect.parameters)
        parameters.push_back({{"id", effect.id},
                              {"effect", effect.type},
                              {"parameter", p.name},
                              {"value", output::json_number(p.value)},
                              {"unit", p.unit},
                              {"std", nullptr},
                              {"interval", {nullptr, nullptr}}});
  return {{"format", "flexspline-unpack/1"},
          {"drive", text_of(block.header.drive)},
          {"model", text_of(block.header.model)},
          {"axis", block.header.axis == 1 ? "linear" : "rotary"},
          {"encoder_counts", block.header.encoder_counts == 0 ? json() : json(block.header.encoder_counts)},
          {"bases", quantities(bases_of(block))},
          {"limits", quantities(limits_of(block))},
          {"effects", effects},
          {"sections", block.sections},
          {"settings", block.settings.empty() ? json() : settings_json(block)},
          {"refused_by_a_drive", block.refusal.empty() ? json() : json(block.refusal)},
          {"parameters", parameters},
          {"coefficients_follow_from_parameters", block.model ? json(block.coefficients_follow) : json()}};
}

int run(const PackCommandOptions& options, Console& console) {
  const model::ModelFile file = load_model(options.model);
  console.progress("proving the block and comparing it with double");
  deployment::Packed packed;
  deployment::PackOptions pack = options.pack;
  if (!options.for_drive.empty()) {
    drive::Session session = open_drive(options.for_drive);
    const deployment::PackOptions of_drive = drive::pack_options_for(session);
    pack.tick_hz = of_drive.tick_hz;
    pack.image = of_drive.image;
    pack.hardware = of_drive.hardware;
  }
  if (!options.drive.empty()) {
    std::ifstream in(options.drive, std::ios::binary);
    if (!in) throw deployment::PackError(fmt::format("{} cannot be read; is the path right?", options.drive.string()));
    pack.settings.emplace(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    pack.settings_origin = options.drive.string();
  }
  try {
    packed = deployment::pack(file.model, pack);
  } catch (const deployment::BoundError& error) {
    console.error(error.what());
    return kNotMet;
  }
  model::save(options.out, std::string(packed.bytes.begin(), packed.bytes.end()));
  console.line(fmt::format("{}: {} bytes, SHA-256 {}", options.out.string(), packed.bytes.size(), packed.sha256));
  console.line(fmt::format("Largest error against double: {} {} on the {} balance, {} of rated torque",
                           number(packed.max_error_nm, kErrorDigits), packed.proof.front().unit, packed.worst_balance,
                           number(packed.max_error_share_of_rated, kErrorDigits)));
  if (packed.torque_scale > 1.0)
    console.line(fmt::format("Torques go up to more than 16 times the rated one: their bases are {:g} times as wide",
                             packed.torque_scale));
  console.line();
  console.line(console.bold(fmt::format("{:<32}{:<18}{:>12}  {}", "part", "bound by", "bound", "unit")));
  for (const auto& part : packed.proof)
    if (!part.observed)
      console.line(
          fmt::format("{:<32}{:<18}{:>12}  {}", part.part, part.kind, number(part.bound, kErrorDigits), part.unit));
  print_errors(packed, console);
  output::save_json(options.json, json_of(packed));
  return kDone;
}

int run(const UnpackOptions& options, Console& console) {
  const std::vector<std::uint8_t> bytes = read_block_file(options.block);
  const deployment::Unpacked block = deployment::unpack(bytes);
  const std::string maker = deployment::maker_of(bytes);
  if (!options.out.empty()) {
    if (!block.model)
      throw deployment::PackError(
          fmt::format("{} has no note of the model that it was made from, so there is none to write; leave out --out",
                      options.block.string()));
    model::save(options.out, model::signed_by_tool(model::write(*block.model)));
  }
  const std::string drive = text_of(block.header.drive);
  console.line(fmt::format("{}: a good block of model \"{}\" for {}", options.block.string(),
                           text_of(block.header.model), drive.empty() ? "any drive" : "drive \"" + drive + "\""));
  if (!maker.empty()) console.line(fmt::format("Made by {}", maker));
  const auto table = [&](const char* title, const std::vector<Named>& all) {
    console.line();
    console.line(console.bold(title));
    for (const Named& q : all) console.line(fmt::format("  {:<22}{:>12}  {}", q.name, number(q.value, 6), q.unit));
  };
  table("Bases", bases_of(block));
  table("Limits", limits_of(block));
  console.line();
  if (block.settings.empty()) {
    console.line(fmt::format("A drive refuses this block: {}. It can be used for simulation only.", block.refusal));
  } else {
    console.line(console.bold("Settings of the drive"));
    for (const auto& q : block.settings)
      console.line(fmt::format("  {:<30}{:>12}  {}", q.name, number(q.value, 6), q.unit));
  }
  console.line();
  console.line(console.bold("Effects, with their coefficients per unit"));
  for (const auto& effect : block.effects) {
    std::string text;
    for (const auto& c : effect.coefficients) text += fmt::format(" {} {:.6g}", c.kind, c.value);
    console.line(fmt::format("  {:<30}{}", effect.type, text));
  }
  if (block.model)
    console.line(block.coefficients_follow
                     ? "The coefficients are, to the bit, what the parameters in the block's note give."
                     : "The block was made by another version: its parameters now give other coefficients.");
  json answer = json_of(block);
  answer["made_by"] = maker.empty() ? json() : json(maker);
  output::save_json(options.json, answer);
  return kDone;
}

void declare(Parser& parser, PackCommandOptions& options) {
  take_model(parser, options.model);
  parser.option("--out", options.out, "the parameter block").required().value("BLOCK");
  Option tick = parser.option("--tick-hz", options.pack.tick_hz, "ticks of the drive's control loop a second");
  tick.shows_default().value("HZ");
  parser.option("--bound", options.pack.bound, "largest error against double, as a share of rated torque")
      .positive()
      .shows_default()
      .value("SHARE");
  parser.flag("--measured", options.pack.measured,
              "where the error cannot be proven, take the largest one along samples of the envelope");
  Option settings = parser.option("--drive", options.drive, "settings of the drive: its loops, limits and sensors")
                        .value("FILE.toml");
  Option image =
      parser.option("--image", options.pack.image, "effects that the firmware has (default: all that can run)");
  image.value("EFFECT").comma_separated().one_value_each_time();
  parser
      .option("--for-drive", options.for_drive,
              "a drive in reach: its tick rate, the effects of its image, and full scales, largest current and "
              "sensors of its board, which the settings then need not state")
      .value("DRIVE")
      .excludes(tick)
      .excludes(image);
  parser
      .option("--drive-name", options.pack.drive,
              "serial number, board or another name of the drive that the block is for; flash --block warns on "
              "another drive (default: any)")
      .value("NAME");
  Option counts = parser.option("--encoder-counts", options.pack.encoder_counts,
                                "per motor turn: the block then has an encoder filter");
  counts.value("COUNTS");
  parser
      .option("--filter-corner-hz", options.pack.filter_corner_hz,
              "corner of the encoder filter; with --drive its corner_hz is taken")
      .positive()
      .shows_default()
      .value("HZ")
      .needs(counts)
      .excludes(settings);
}

void declare(Parser& parser, UnpackOptions& options) {
  parser.option("BLOCK", options.block, "parameter block").required().value("");
  parser.option("--out", options.out, "the model that the block was made from (default: print only)").value("MODEL");
}

}  // namespace

Command pack_command() {
  return command<PackCommandOptions>(
      {"pack",
       "makes the parameter block of a drive from a model, with its proof",
       "Turns a model into the bytes that a drive computes with: bases from the ratings in [drive], coefficients as "
       "integers, and a checksum. Proves that no number can leave its range whatever the drive measures within twice "
       "its ratings, bounds for each effect and for the sum how far the drive can be from the equations, and compares "
       "the block with the model in double precision along a hundred thousand samples of the whole envelope. A model "
       "that does not fit, "
       "whose error along the samples is above --bound, or whose error has no bound that can be proven (unless "
       "--measured goes without one), is refused with the reason (exit code 1 for the error, 2 for all else). The "
       "model's parameters go into the block too, for unpack. With --drive the block has "
       "all that a drive needs: loops (50 Hz velocity with integral, 10 Hz position), limits, sensors, feedforward "
       "and observers, as a TOML file states them (host/drive_link/deployment/README.md has the keys) and else as the "
       "ratings "
       "and the model suggest. Without it a block is for simulation only; a drive refuses it.",
       {kMakeData, kIdentify, "flexspline pack --model fitted.toml --out drive.block --encoder-counts 4096",
        "printf 'format = \"flexspline-drive/1\"\\n[output_encoder]\\ncounts = 65536\\n' | tee drive.toml",
        "flexspline pack --model fitted.toml --drive drive.toml --tick-hz 20000 --encoder-counts 4096 --out "
        "full.block"}},
      declare, run);
}

Command unpack_command() {
  return command<UnpackOptions>(
      {"unpack",
       "checks a parameter block and prints its contents",
       "Checks a block with the drive's own code, prints its contents in SI, and with --out writes the "
       "model that it was made from. A damaged block is refused: which entry and field, and why.",
       {kMakeData, kIdentify, "flexspline pack --model fitted.toml --out drive.block",
        "flexspline unpack drive.block --out again.toml"}},
      declare, run);
}

}  // namespace flexspline::cli
