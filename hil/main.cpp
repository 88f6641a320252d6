// g++ 12 reports a null pointer in CLI11's inlined std::vector growth, wrongly.
#pragma GCC diagnostic ignored "-Wnull-dereference"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "hil/board/three_phase.hpp"
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

void add_record(CLI::App& app) {
  const auto options = std::make_shared<RecordOptions>();
  CLI::App* command = app.add_subcommand("record", "simulates the experiments of a plant file and writes a data set");
  command->add_option("--out", options->out, "folder to write into")->required();
  command->add_option("--plant", options->plant_file, "plant file (default: the demo's drive, built in)");
  command->add_option("--plan", options->plan,
                      "runs of a plan that `flexspline plan` wrote, instead of the plant file's experiments");
  command->add_option("--hide", options->hide, "effect that the base model does not have, such as torque_ripple:2");
  command->add_option("--scale", options->scale, "size of the hidden effect, 1 = usual")->needs("--hide");
  command->add_option("--with", options->with, "effects that the drive and the base model have, A,B")->delimiter(',');
  command
      ->add_option("--friction-variation", options->friction_variation,
                   "relative std of friction from record to record")
      ->check(CLI::Range(0.0, 0.3));
  command->add_option("--noise-correlation", options->noise_correlation, "AR(1) coefficient of the noise")
      ->check(CLI::Range(0.0, 0.999));
  command->add_flag("--tachometer", options->tachometer, "record a tachometer as well");
  command->add_option("--seed", options->seed, "of all random numbers (default 1)");
  command->add_flag("--force", options->force, "write into a folder that is not empty");
  command->footer("Example: flexspline-hil record --out data --hide stribeck_gaussian --seed 7");
  command->callback([options] { record(*options); });
}

void add_rhs(CLI::App& app) {
  const auto options = std::make_shared<RecordOptions>();
  CLI::App* command = app.add_subcommand(
      "rhs-100", "makes the experiments of Taghirad and Belanger's report, each with the parameters of its own row");
  command->add_option("--out", options->out, "folder to write into")->required();
  command->add_option("--part", options->parts, "only these, A,B: table-1, table-3, table-4, table-6, table-7, table-8")
      ->delimiter(',');
  command->add_option("--seed", options->seed, "of all random numbers (default 1)");
  command->add_flag("--force", options->force, "write into a folder that is not empty");
  command->footer("Example: flexspline-hil rhs-100 --out rhs-100");
  command->callback([options] { make_rhs_100(*options); });
}

void add_report(CLI::App& app) {
  const auto options = std::make_shared<flexspline::thesis_figures::ReportOptions>();
  CLI::App* command =
      app.add_subcommand("report", "draws the figures of Taghirad and Belanger's report again, as SVG and CSV");
  command->add_option("figure", options->what, "number of a figure, all, or list")->required();
  command->add_option("--out", options->out, "folder to write into");
  command->add_option("--seed", options->seed, "of all random numbers")->capture_default_str();
  command->footer("Example: flexspline-hil report 45 --out figures");
  command->callback([options] { flexspline::thesis_figures::write_report(*options); });
}

void add_model(CLI::App& app) {
  const auto options = std::make_shared<flexspline::thesis_figures::ReportOptions>();
  CLI::App* command = app.add_subcommand(
      "model", "runs the report's own blocks: DC motor, saturation, friction block, models 1 to 3; SVG and CSV");
  command->add_option("block", options->what, "motor, saturation, friction, models or all")->required();
  command->add_option("--out", options->out, "folder to write into")->required();
  command->footer("Example: flexspline-hil model friction --out blocks");
  command->callback([options] { flexspline::thesis_figures::write_models(*options); });
}

void add_drive(CLI::App& app) {
  const auto options = std::make_shared<flexspline::scenario::DriveOptions>();
  CLI::App* command = app.add_subcommand(
      "drive", "runs the firmware's application on a simulated drive, with and without compensation");
  command->add_option("--scenario", options->scenario, "a file, or one of `flexspline-hil scenarios` (default sine)");
  command->add_option("--seconds", options->seconds, "simulated time (default: the scenario's)")
      ->check(CLI::Range(0.01, 36000.0));
  command->add_option("--plant", options->plant_file, "plant file (default: the demo's drive, built in)");
  command->add_option("--with", options->with, "effects that the drive and its model have, A,B")->delimiter(',');
  command->add_option("--hide", options->hide, "effect that the drive has and its model does not have");
  command->add_option("--compensation", options->compensation, "on, off, both (default)")
      ->check(CLI::IsMember({"on", "off", "both"}));
  command->add_option("--inject", options->inject, "failure to inject, such as motor-encoder-stuck");
  command->add_option("--inject-at", options->inject_at_s, "its time in seconds (default: half the run)");
  command->add_option(
      "--block", options->block_file,
      "parameter block of `flexspline pack` for this --tick-hz: the drive's model (default: the plant's)");
  command->add_option("--motor", options->motor, "what its amplifier takes: current (default), or three-phase")
      ->check(CLI::IsMember({"current", "three-phase"}));
  command->add_option("--processor", options->processor_image,
                      "firmware image to run it on, in QEMU (boards/qemu_stm32f405)");
  command->add_option("--trace", options->trace_file, "CSV of one run, a line a millisecond");
  command->add_option("--json", options->json, "file for the result; - is standard output");
  command->add_option("--tick-hz", options->tick_hz, "ticks of the drive per second, a multiple of 1000")
      ->capture_default_str();
  command->add_option("--seed", options->seed,
                      "of the sensors' noise, and of the motor's angle at power-on (default 1)");
  command->add_option("--start-turns", options->wake_turns, "the motor's angle at power-on (default: random within 2)")
      ->check(CLI::Range(-100.0, 100.0));
  command->footer("Example: flexspline-hil drive --scenario slow-reversals --seconds 4");
  command->callback([options] { flexspline::scenario::run_drive(*options); });
}

void add_sheet(CLI::App& app) {
  const auto options = std::make_shared<flexspline::scenario::DataSheetOptions>();
  CLI::App* command =
      app.add_subcommand("data-sheet", "writes the data sheet of a drive: settings, and models with its true values");
  command->add_option("--scenario", options->scenario, "whose drive it is (default: none)");
  command->add_option("--plant", options->plant_file, "plant file (default: the demo's drive, built in)");
  command->add_option("--with", options->with, "effects that the drive has and its data sheet has, A,B")
      ->delimiter(',');
  command->add_option("--hide", options->hide, "effect that is not in the data sheet");
  command->add_option("--out", options->out, "folder to write into")->required();
  command->footer("Example: flexspline-hil data-sheet --hide gravity --out sheet");
  command->callback([options] { flexspline::scenario::write_data_sheet(*options); });
}

void add_scenarios(CLI::App& app) {
  CLI::App* command = app.add_subcommand("scenarios", "lists the scenarios that come with the tool");
  command->callback([] { flexspline::scenario::list_scenarios(); });
}

// Where hosts find it, and for how long.
void take_twin_address(CLI::App& command, flexspline::twin::TwinOptions& options) {
  command.add_option("--serve", options.port, "port on 127.0.0.1 (default and 0: any that is free)")
      ->check(CLI::Range(0, 65535));
  command
      .add_option(
          "--token", options.token,
          "32 hexadecimal digits, the end of its address: with the token of an earlier twin, hosts find it again")
      ->check([](const std::string& text) {
        const bool good = text.size() == 32 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
        return good ? std::string() : "not 32 digits of 0 to 9 and a to f";
      });
  command
      .add_option("--usbip", options.usbip, "a USB device instead: port of its USB/IP server, 0 any (3240 is usual)")
      ->check(CLI::Range(0, 65535));
  command.add_option("--seconds", options.seconds, "ends after this time (default: never)")->check(CLI::PositiveNumber);
  command.add_option("--json", options.json_file, "writes its address into this file; - is standard output");
  command.add_flag("--pty", options.pty, "a serial line (pseudo terminal) instead of a port");
  command.add_flag("--inherit", options.inherits, "uses standard input, which has to be a socket");
}

// What it is a twin of.
void take_twin_drive(CLI::App& command, flexspline::twin::TwinOptions& options) {
  command.add_option("--plant", options.plant_file, "plant file (default: the demo's drive, built in)");
  command.add_option("--with", options.with, "effects that the drive has and its data sheet has, A,B")->delimiter(',');
  command.add_option("--hide", options.hide, "effect that the drive has and its data sheet does not have");
  command.add_option("--motor", options.motor, "what its amplifier takes: current (default), or three-phase")
      ->check(CLI::IsMember({"current", "three-phase"}));
  command.add_option("--motor-seed", options.motor_seed,
                     "with --motor three-phase: a random motor that it was not commissioned with");
  command.add_option("--wiring-fault", options.wiring_fault,
                     "of the three-phase motor, such as phase-open-b, phases-swapped, encoder-slips");
  command.add_option("--motor-ripple", options.motor_ripple,
                     "what the three-phase motor has since it was commissioned: cogging, cogging-magnet, "
                     "current-offset, current-gain, back-emf, dead-time, encoder-eccentricity");
  command.add_option("--motor-ripple-size", options.motor_ripple_size, "1 = usual")->needs("--motor-ripple");
  command.add_option("--flash", options.flash_file, "file that holds its flash memory (default: none)");
  command.add_option("--serial", options.serial, "serial number (default TWIN)")
      ->check([](const std::string& text) -> std::string {
        constexpr const char* kLetters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.";
        const bool good = !text.empty() && text.size() <= 16 && text.find_first_not_of(kLetters) == std::string::npos;
        return good ? "" : "a serial number has 1 to 16 letters, digits, - _ .";
      });
}

// What goes wrong, and how it runs.
void take_twin_run(CLI::App& command, flexspline::twin::TwinOptions& options) {
  command.add_option("--link-fault", options.link_fault_file,
                     "file that unplugs it: contains in, out, or out N (after N more messages of the host)");
  command.add_option("--inject", options.inject, "failure after it was armed, such as motor-encoder-stuck");
  command.add_option("--inject-at", options.inject_at_s, "time after it was armed, s (default 1)");
  command.add_option("--seed", options.seed, "of the sensors' noise (default 1)");
  command.add_flag("--empty", options.empty, "an empty flash memory stays without parameters");
  command.add_flag("--locked", options.locked, "the output is locked");
  command.add_flag("--fast", options.fast, "while armed faster than real time, as far as its host follows");
  command.add_flag("--lossy", options.lossy, "with --fast: does not wait for a host that reads slowly");
}

void add_twin(CLI::App& app) {
  const auto options = std::make_shared<flexspline::twin::TwinOptions>();
  CLI::App* command = app.add_subcommand("twin", "a drive for `flexspline --drive`, until it is stopped");
  take_twin_address(*command, *options);
  take_twin_drive(*command, *options);
  take_twin_run(*command, *options);
  command->footer("Example: flexspline-hil twin --serve 4711 --flash twin.flash");
  command->callback([options] { flexspline::twin::run_twin(*options); });
}

struct MotorOptions {
  std::string plant_file;
  std::uint64_t seed = 1;
};

// The truth, for whoever compares it with what `flexspline commission` finds.
void print_motor(const MotorOptions& options) {
  const auto p = flexspline::board::drawn_motor(open_plant(options.plant_file).drive, options.seed);
  fmt::print(
      "{{\"format\": \"flexspline-hil-motor/1\", \"resistance_ohm\": {:.9g}, \"switch_ohm\": {:.9g}, "
      "\"inductance_d_h\": {:.9g}, \"inductance_q_h\": {:.9g}, \"flux_vs\": {:.9g}, \"pole_pairs\": {}, \"slots\": {}, "
      "\"phases_swapped\": {}, \"offset_deg\": {:.9g}, \"current_gain\": [{:.9g}, {:.9g}, {:.9g}], "
      "\"current_offset_a\": [{:.9g}, {:.9g}, {:.9g}]}}\n",
      p.motor.resistance_ohm, p.inverter.on_resistance_ohm, p.motor.inductance_d_h, p.motor.inductance_q_h,
      p.motor.flux_vs, p.motor.pole_pairs, flexspline::board::usual_slots(p.motor.pole_pairs),
      p.wiring.motor_phase[1] == 2, 360.0 * p.offset_turns, p.sensors.gain[0], p.sensors.gain[1], p.sensors.gain[2],
      p.sensors.offset_a[0], p.sensors.offset_a[1], p.sensors.offset_a[2]);
}

void add_motor(CLI::App& app) {
  const auto options = std::make_shared<MotorOptions>();
  CLI::App* command =
      app.add_subcommand("motor", "prints the motor that `twin --motor three-phase --motor-seed` draws, as JSON");
  command->add_option("--plant", options->plant_file, "plant file (default: the demo's drive, built in)");
  command->add_option("--seed", options->seed, "the --motor-seed")->required();
  command->footer("Example: flexspline-hil motor --seed 1");
  command->callback([options] { print_motor(*options); });
}

void add_image(CLI::App& app) {
  const auto options = std::make_shared<ImageOptions>();
  CLI::App* command =
      app.add_subcommand("image", "makes a firmware image for the twin, for `flexspline flash --firmware`");
  command->add_option("--out", options->out, "file to write")->required();
  command->add_option("--major", options->major, "version, before the point (default 0)")->check(CLI::Range(0, 255));
  command->add_option("--minor", options->minor, "version, after the point (default 1)")->check(CLI::Range(0, 255));
  command->add_option("--bytes", options->bytes, "after its header (default 24000)")->check(CLI::Range(64, 64'000));
  command->add_flag("--hangs", options->hangs, "it never confirms itself, and is rolled back");
  command->add_option("--counter", options->counter, "security counter (default 0)");
  command->add_flag("--unsigned", options->is_unsigned, "without a signature: the twin does not take it");
  command->footer("Example: flexspline-hil image --minor 2 --out twin-0.2.image");
  command->callback([options] { make_image(*options); });
}

void add_effects(CLI::App& app) {
  const auto options = std::make_shared<RecordOptions>();
  CLI::App* command = app.add_subcommand("effects", "lists what can be hidden");
  command->add_option("--plant", options->plant_file, "plant file (default: the demo's drive, built in)");
  command->callback([options] { list_effects(options->plant_file); });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"The twin of a strain-wave drive: records measurements of a drive whose truth is known."};
  app.require_subcommand(1);
  add_record(app);
  add_rhs(app);
  add_report(app);
  add_model(app);
  add_drive(app);
  add_sheet(app);
  add_scenarios(app);
  add_twin(app);
  add_motor(app);
  add_image(app);
  add_effects(app);
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
