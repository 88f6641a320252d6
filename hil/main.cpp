// g++ 12 reports a null pointer in CLI11's inlined std::vector growth, wrongly.
#pragma GCC diagnostic ignored "-Wnull-dereference"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "hil/plant/parameters.hpp"
#include "hil/plant/recorder.hpp"
#include "hil/rhs100/data_set.hpp"
#include "hil/scenario/command_drive.hpp"
#include "hil/thesis_figures/command.hpp"
#include "hil/twin/image.hpp"
#include "hil/twin/server.hpp"

namespace {

namespace plant = flexspline::plant;

struct RecordOptions {
  std::string out;
  std::string plant_file;
  std::string plan;
  std::string hide;
  std::vector<std::string> with;
  std::vector<std::string> parts;
  double scale = 1.0;
  double friction_variation = -1.0;
  double noise_correlation = -1.0;
  bool tachometer = false;
  bool force = false;
  std::uint64_t seed = 1;
};

plant::PlantFile open_plant(const std::string& file) {
  return file.empty() ? plant::demo_plant() : plant::load_plant(file);
}

void require_empty(const RecordOptions& options) {
  if (!options.force && std::filesystem::exists(options.out) && !std::filesystem::is_empty(options.out)) {
    throw std::runtime_error(options.out +
                             ": is there and not empty; give another folder, or --force to write into it");
  }
}

void record(const RecordOptions& options) {
  plant::PlantFile file = open_plant(options.plant_file);
  plant::Drive& drive = file.drive;
  for (const std::string& name : options.with) plant::with(drive, name);
  if (!options.hide.empty()) plant::hide(drive, options.hide, options.scale);
  if (options.friction_variation >= 0.0) drive.friction_variation = options.friction_variation;
  if (options.noise_correlation >= 0.0) {
    drive.sensors.current.correlation = options.noise_correlation;
    drive.sensors.torque.correlation = options.noise_correlation;
    drive.sensors.tachometer.correlation = options.noise_correlation;
  }
  if (options.tachometer) drive.sensors.has_tachometer = true;
  if (!options.plan.empty()) file.experiments = plant::load_plan(options.plan, drive);
  if (file.experiments.empty() && !options.plan.empty())
    throw std::runtime_error(options.plan + ": the plan has no [[run]]: there is nothing to record");
  if (file.experiments.empty()) throw std::runtime_error("the plant file has no [[experiment]]; add one to record");
  require_empty(options);
  plant::write_dataset(plant::record_all(drive, file.experiments, options.seed), drive, options.out);
  fmt::print("{} experiments in {}\n", file.experiments.size(), options.out);
}

void make_rhs_100(const RecordOptions& options) {
  require_empty(options);
  const std::size_t written = flexspline::rhs100::write_data_set(options.out, options.parts, options.seed);
  fmt::print("{} experiments in {}\n", written, options.out);
}

struct ImageOptions {
  std::string out;
  int major = 0;
  int minor = 1;
  std::size_t bytes = 24'000;
  bool hangs = false;
  bool is_unsigned = false;
  std::uint16_t counter = 0;
};

void make_image(const ImageOptions& options) {
  const flexspline::boot::Version version{static_cast<std::uint8_t>(options.major),
                                          static_cast<std::uint8_t>(options.minor)};
  const auto image = flexspline::twin::twin_image({.version = version,
                                                   .bytes = options.bytes,
                                                   .hangs = options.hangs,
                                                   .is_signed = !options.is_unsigned,
                                                   .security_counter = options.counter});
  std::ofstream out(options.out, std::ios::binary);
  out.write(reinterpret_cast<const char*>(image.data()), static_cast<std::streamsize>(image.size()));
  if (!out.flush()) throw std::runtime_error(options.out + ": cannot be written");
  fmt::print("{}: firmware {}.{} for board {}, {} bytes\n", options.out, options.major, options.minor,
             flexspline::twin::kBoardName, image.size());
}

void list_effects(const std::string& plant_file) {
  const plant::PlantFile file = open_plant(plant_file);
  fmt::print("effects of {} (* = part of the drive as it is):\n", file.drive.name);
  for (const plant::Effect& effect : file.drive.effects) {
    std::string values;
    for (const plant::Parameter& p : effect.parameters) {
      if (p.key != "order") values += fmt::format("{}{} {:g} {}", values.empty() ? "" : ", ", p.key, p.value, p.unit);
    }
    fmt::print("{} {:<26} {}{}\n", effect.present ? '*' : ' ', effect.label(), values,
               effect.catalogue ? "" : "   (in no catalogue)");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"The twin of a strain-wave drive: records measurements of a drive whose truth is known."};
  app.require_subcommand(1);
  RecordOptions options;
  CLI::App* record_command =
      app.add_subcommand("record", "simulates the experiments of a plant file and writes a data set");
  record_command->add_option("--out", options.out, "folder to write into")->required();
  record_command->add_option("--plant", options.plant_file, "plant file (default: the demo's drive, built in)");
  record_command->add_option("--plan", options.plan,
                             "runs of a plan that `flexspline plan` wrote, instead of the plant file's experiments");
  record_command->add_option("--hide", options.hide,
                             "effect that the base model does not have, such as torque_ripple:2");
  record_command->add_option("--scale", options.scale, "size of the hidden effect, 1 = usual")->needs("--hide");
  record_command->add_option("--with", options.with, "effects that the drive and the base model have, A,B")
      ->delimiter(',');
  record_command
      ->add_option("--friction-variation", options.friction_variation, "relative std of friction from record to record")
      ->check(CLI::Range(0.0, 0.3));
  record_command->add_option("--noise-correlation", options.noise_correlation, "AR(1) coefficient of the noise")
      ->check(CLI::Range(0.0, 0.999));
  record_command->add_flag("--tachometer", options.tachometer, "record a tachometer as well");
  record_command->add_option("--seed", options.seed, "of all random numbers (default 1)");
  record_command->add_flag("--force", options.force, "write into a folder that is not empty");
  record_command->footer("Example: flexspline-hil record --out data --hide stribeck_gaussian --seed 7");
  record_command->callback([&] { record(options); });
  CLI::App* rhs_command = app.add_subcommand(
      "rhs-100", "makes the experiments of Taghirad and Belanger's report, each with the parameters of its own row");
  rhs_command->add_option("--out", options.out, "folder to write into")->required();
  rhs_command
      ->add_option("--part", options.parts, "only these, A,B: table-1, table-3, table-4, table-6, table-7, table-8")
      ->delimiter(',');
  rhs_command->add_option("--seed", options.seed, "of all random numbers (default 1)");
  rhs_command->add_flag("--force", options.force, "write into a folder that is not empty");
  rhs_command->footer("Example: flexspline-hil rhs-100 --out rhs-100");
  rhs_command->callback([&] { make_rhs_100(options); });
  flexspline::thesis_figures::ReportOptions report_options, model_options;
  CLI::App* report_command =
      app.add_subcommand("report", "draws the figures of Taghirad and Belanger's report again, as SVG and CSV");
  report_command->add_option("figure", report_options.what, "number of a figure, all, or list")->required();
  report_command->add_option("--out", report_options.out, "folder to write into");
  report_command->add_option("--seed", report_options.seed, "of all random numbers")->capture_default_str();
  report_command->footer("Example: flexspline-hil report 45 --out figures");
  report_command->callback([&] { flexspline::thesis_figures::write_report(report_options); });
  CLI::App* model_command = app.add_subcommand(
      "model", "runs the report's own blocks: DC motor, saturation, friction block, models 1 to 3; SVG and CSV");
  model_command->add_option("block", model_options.what, "motor, saturation, friction, models or all")->required();
  model_command->add_option("--out", model_options.out, "folder to write into")->required();
  model_command->footer("Example: flexspline-hil model friction --out blocks");
  model_command->callback([&] { flexspline::thesis_figures::write_models(model_options); });
  flexspline::scenario::DriveOptions drive_options;
  CLI::App* drive_command = app.add_subcommand(
      "drive", "runs the firmware's application on a simulated drive, with and without compensation");
  drive_command->add_option("--scenario", drive_options.scenario,
                            "a file, or one of `flexspline-hil scenarios` (default sine)");
  drive_command->add_option("--seconds", drive_options.seconds, "simulated time (default: the scenario's)")
      ->check(CLI::Range(0.01, 36000.0));
  drive_command->add_option("--plant", drive_options.plant_file, "plant file (default: the demo's drive, built in)");
  drive_command->add_option("--with", drive_options.with, "effects that the drive and its model have, A,B")
      ->delimiter(',');
  drive_command->add_option("--hide", drive_options.hide, "effect that the drive has and its model does not have");
  drive_command->add_option("--compensation", drive_options.compensation, "on, off, both (default)")
      ->check(CLI::IsMember({"on", "off", "both"}));
  drive_command->add_option("--inject", drive_options.inject, "failure to inject, such as motor-encoder-stuck");
  drive_command->add_option("--inject-at", drive_options.inject_at_s, "its time in seconds (default: half the run)");
  drive_command->add_option(
      "--block", drive_options.block_file,
      "parameter block of `flexspline pack` for this --tick-hz: the drive's model (default: the plant's)");
  drive_command->add_option("--processor", drive_options.processor_image,
                            "firmware image to run it on, in QEMU (boards/qemu_stm32f405)");
  drive_command->add_option("--trace", drive_options.trace_file, "CSV of one run, a line a millisecond");
  drive_command->add_option("--json", drive_options.json, "file for the result; - is standard output");
  drive_command->add_option("--tick-hz", drive_options.tick_hz, "ticks of the drive per second, a multiple of 1000")
      ->capture_default_str();
  drive_command->add_option("--seed", drive_options.seed, "of the sensors' noise (default 1)");
  drive_command->footer("Example: flexspline-hil drive --scenario slow-reversals --seconds 4");
  drive_command->callback([&] { flexspline::scenario::run_drive(drive_options); });
  flexspline::scenario::DataSheetOptions sheet;
  CLI::App* sheet_command =
      app.add_subcommand("data-sheet", "writes the data sheet of a drive: settings, and models with its true values");
  sheet_command->add_option("--scenario", sheet.scenario, "whose drive it is (default: none)");
  sheet_command->add_option("--plant", sheet.plant_file, "plant file (default: the demo's drive, built in)");
  sheet_command->add_option("--with", sheet.with, "effects that the drive has and its data sheet has, A,B")
      ->delimiter(',');
  sheet_command->add_option("--hide", sheet.hide, "effect that is not in the data sheet");
  sheet_command->add_option("--out", sheet.out, "folder to write into")->required();
  sheet_command->footer("Example: flexspline-hil data-sheet --hide gravity --out sheet");
  sheet_command->callback([&] { flexspline::scenario::write_data_sheet(sheet); });
  CLI::App* scenarios_command = app.add_subcommand("scenarios", "lists the scenarios that come with the tool");
  scenarios_command->callback([&] { flexspline::scenario::list_scenarios(); });
  flexspline::twin::TwinOptions twin_options;
  CLI::App* twin_command = app.add_subcommand("twin", "a drive for `flexspline --drive`, until it is stopped");
  twin_command->add_option("--serve", twin_options.port, "port on 127.0.0.1 (default and 0: any that is free)")
      ->check(CLI::Range(0, 65535));
  twin_command
      ->add_option(
          "--token", twin_options.token,
          "32 hexadecimal digits, the end of its address: with the token of an earlier twin, hosts find it again")
      ->check([](const std::string& text) {
        const bool good = text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
        return good ? std::string() : "not 32 digits of 0 to 9 and a to f";
      });
  twin_command
      ->add_option("--usbip", twin_options.usbip,
                   "a USB device instead: port of its USB/IP server, 0 any (3240 is usual)")
      ->check(CLI::Range(0, 65535));
  twin_command->add_option("--seconds", twin_options.seconds, "ends after this time (default: never)")
      ->check(CLI::PositiveNumber);
  twin_command->add_option("--json", twin_options.json_file, "writes its address into this file; - is standard output");
  twin_command->add_flag("--pty", twin_options.pty, "a serial line (pseudo terminal) instead of a port");
  twin_command->add_flag("--inherit", twin_options.inherits, "uses standard input, which has to be a socket");
  twin_command->add_option("--plant", twin_options.plant_file, "plant file (default: the demo's drive, built in)");
  twin_command->add_option("--with", twin_options.with, "effects that the drive has and its data sheet has, A,B")
      ->delimiter(',');
  twin_command->add_option("--hide", twin_options.hide, "effect that the drive has and its data sheet does not have");
  twin_command->add_option("--flash", twin_options.flash_file, "file that holds its flash memory (default: none)");
  twin_command->add_option("--serial", twin_options.serial, "serial number (default TWIN)")
      ->check([](const std::string& text) -> std::string {
        constexpr const char* kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
        const bool good = !text.empty() && text.size() <= 16 && text.find_first_not_of(kLetters) == std::string::npos;
        return good ? "" : "a serial number has 1 to 16 letters, digits, - _ .";
      });
  twin_command->add_option("--cable", twin_options.cable_file,
                           "file that unplugs it: contains in, out, or out N (after N more messages of the host)");
  twin_command->add_option("--inject", twin_options.inject, "failure after it was armed, such as motor-encoder-stuck");
  twin_command->add_option("--inject-at", twin_options.inject_at_s, "time after it was armed, s (default 1)");
  twin_command->add_option("--seed", twin_options.seed, "of the sensors' noise (default 1)");
  twin_command->add_flag("--empty", twin_options.empty, "an empty flash memory stays without parameters");
  twin_command->add_flag("--locked", twin_options.locked, "the output is locked");
  twin_command->add_flag("--fast", twin_options.fast, "while armed faster than real time, as far as its host follows");
  twin_command->add_flag("--lossy", twin_options.lossy, "with --fast: does not wait for a host that reads slowly");
  twin_command->footer("Example: flexspline-hil twin --serve 4711 --flash twin.flash");
  twin_command->callback([&] { flexspline::twin::run_twin(twin_options); });
  ImageOptions image_options;
  CLI::App* image_command =
      app.add_subcommand("image", "makes a firmware image for the twin, for `flexspline flash --firmware`");
  image_command->add_option("--out", image_options.out, "file to write")->required();
  image_command->add_option("--major", image_options.major, "version, before the point (default 0)")
      ->check(CLI::Range(0, 255));
  image_command->add_option("--minor", image_options.minor, "version, after the point (default 1)")
      ->check(CLI::Range(0, 255));
  image_command->add_option("--bytes", image_options.bytes, "after its header (default 24000)")
      ->check(CLI::Range(64, 64'000));
  image_command->add_flag("--hangs", image_options.hangs, "it never confirms itself, and is rolled back");
  image_command->add_option("--counter", image_options.counter, "security counter (default 0)");
  image_command->add_flag("--unsigned", image_options.is_unsigned, "without a signature: the twin does not take it");
  image_command->footer("Example: flexspline-hil image --minor 2 --out twin-0.2.image");
  image_command->callback([&] { make_image(image_options); });
  CLI::App* effects_command = app.add_subcommand("effects", "lists what can be hidden");
  effects_command->add_option("--plant", options.plant_file, "plant file (default: the demo's drive, built in)");
  effects_command->callback([&] { list_effects(options.plant_file); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "flexspline-hil: {}\n", error.what());
    return 2;
  }
  return 0;
}
