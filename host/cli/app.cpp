#include "host/cli/app.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "host/cli/arguments.hpp"
#include "host/cli/commands.hpp"
#include "host/cli/drive_options.hpp"
#include "host/cli/export_options.hpp"
#include "host/cli/firmware_options.hpp"
#include "host/cli/fleet.hpp"
#include "host/cli/help.hpp"
#include "host/cli/help_format.hpp"
#include "host/cli/hil_options.hpp"
#include "host/cli/manual.hpp"
#include "host/cli/new_options.hpp"
#include "host/cli/workbench_options.hpp"
#include "host/data/findings.hpp"
#include "host/output/text.hpp"
#include "host/text/build_identity.hpp"
#include "host/text/nearest.hpp"

namespace flexspline::cli {
namespace {

constexpr const char* kDataHelp =
    "measurements: any number of recordings (CSV, MAT, HDF5, NumPy, ROS, MCAP), folders, dataset.tomls";

// A command as it was parsed, ready to run.
struct ChosenCommand {
  std::function<int(Console&)> run;
  std::string json;
};

class App {
 public:
  App() {
    app_.name("flexspline");
    app_.description(output::wrapped(
        "Flexspline finds out which physical effects a drive with strain-wave gear has, and which its model lacks.",
        0));
    app_.formatter(std::make_shared<HelpFormat>());
    app_.require_subcommand(1);
    app_.set_version_flag("--version", text::tool_name(), "which build this is");
    add_demo();
    add_new();
    add_check();
    add_effects();
    add_measure();
    add_identify();
    add_simulate();
    add_compare();
    add_diagnose();
    add_add();
    take_change(command<RemoveOptions>("remove"), "id of the effect in the model, or its type");
    add_sensitivity();
    add_pack();
    add_export();
    add_plan();
    add_drive_commands();
    const auto [hil, hil_options] = command<HilOptions>("hil");
    take_hil(hil, *hil_options);
    add_manual();
    take_fleet(command<FleetOptions>("fleet"));
    add_workbench();
    app_.footer(output::wrapped(
        "flexspline COMMAND --help explains each with an example. Exit codes: 0 done, 1 a limit that was "
        "given is not met, 2 unusable input or arguments.",
        0));
  }

  int run(int argc, char** argv) {
    const int code = parse_and_run(argc, argv);
    const std::string reason = output::unwritten();
    if (reason.empty() || code == kUnusable) return code;
    fmt::print(stderr,
               "flexspline: the answer could not be written to standard output: {}; make room, or redirect it\n",
               reason);
    return code == kDone ? kUnusable : code;
  }

 private:
  int parse_and_run(int argc, char** argv) {
    std::vector<std::string> arguments = arguments_from(argc, argv);
    const std::string command = arguments.empty() ? "" : arguments[0];
    if (const std::string problem = wrong_command(command); !problem.empty()) {
      fmt::print(stderr, "flexspline: {}\n", problem);
      return kUnusable;
    }
    try {
      app_.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));  // which takes the last one first
    } catch (const CLI::ParseError& error) {
      if (error.get_exit_code() == 0) return app_.exit(error);
      const std::string misspelt = misspelt_option(arguments, options_of(command));
      fmt::print(stderr, "flexspline {}: {}; flexspline {} --help shows what it takes\n", command,
                 misspelt.empty() ? error.what() : misspelt.c_str(), command);
      return kUnusable;
    }
    return run_chosen(command);
  }

  std::string wrong_command(const std::string& command) const {
    if (command.empty()) return "no command was given; flexspline --help lists them";
    if (command.starts_with("-")) return {};
    std::vector<std::string> names;
    for (const CLI::App* sub : app_.get_subcommands([](const CLI::App*) { return true; }))
      names.push_back(sub->get_name());
    if (std::find(names.begin(), names.end(), command) != names.end()) return {};
    const std::vector<std::string_view> known(names.begin(), names.end());
    const std::string near = text::nearest(command, known);
    return fmt::format(
        "there is no command \"{}\"; {}", command,
        near.empty() ? std::string("flexspline --help lists them") : fmt::format("did you mean {}?", near));
  }

  std::vector<std::string> options_of(const std::string& command) const {
    std::vector<std::string> names;
    for (const CLI::App* sub : app_.get_subcommands([&](const CLI::App* one) { return one->get_name() == command; }))
      for (const CLI::Option* option : sub->get_options())
        for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    return names;
  }

  int run_chosen(const std::string& command) {
    Console console(command, chosen_.json == "-");
    try {
      return chosen_.run(console);
    } catch (const data::DataError& error) {
      for (const data::Finding& finding : error.findings())
        if (finding.severity == data::Severity::error) console.error(finding.text());
    } catch (const std::exception& error) {
      console.error(error.what());
    }
    return kUnusable;
  }

  template <class Options>
  std::pair<CLI::App*, std::shared_ptr<Options>> command(std::string_view name) {
    const CommandHelp& help = help_of(name);
    CLI::App* sub = app_.add_subcommand(std::string(name), std::string(help.summary));
    sub->footer(output::wrapped(help.description, 0) + "\n\n" + example_text(help));
    auto options = std::make_shared<Options>();
    sub->add_option("--json", options->json, "write the answer as JSON into this file; - is standard output")
        ->type_name("FILE");
    sub->callback([this, options] {
      chosen_.json = options->json;
      chosen_.run = [options](Console& console) { return cli::run(*options, console); };
    });
    return {sub, options};
  }

  static void take_data(CLI::App* sub, DataInputs& inputs) {
    sub->add_option("DATA", inputs.data, kDataHelp)->required()->type_name("");
    take_tolerate(sub, inputs);
  }

  static void take_tolerate(CLI::App* sub, DataInputs& inputs) {
    sub->add_option("--tolerate", inputs.tolerate,
                    fmt::format("treat a finding as a warning; kinds: {}", data::tolerable_kinds()))
        ->type_name("KIND")
        ->delimiter(',')
        ->allow_extra_args(false);
  }

  static void take_holdout(CLI::App* sub, DataInputs& inputs) {
    sub->add_option("--holdout", inputs.holdout, "measurements for validation, never fitted, whatever role they state")
        ->type_name("DATA");
  }

  static void take_model(CLI::App* sub, std::filesystem::path& model) {
    sub->add_option("--model", model, "model file")->required()->type_name("MODEL");
  }

  static void take_pipeline(CLI::App* sub, PipelineInputs& pipeline) {
    sub->add_option("--cutoff-hz", pipeline.cutoff_hz, "cut-off of both filters (default: chosen from the data)")
        ->type_name("HZ");
    sub->add_option("--mask", pipeline.mask, "auto leaves out reversals and sticking, none keeps them (default: auto)")
        ->check(CLI::IsMember({"auto", "none"}))
        ->type_name("");
  }

  static void take_report(CLI::App* sub, std::filesystem::path& report) {
    sub->add_option("--report", report, "write a page with plots for a browser or a printer (HTML, all in one file)")
        ->type_name("FILE");
  }

  void add_demo() {
    const auto [sub, options] = command<DemoOptions>("demo");
    sub->add_option("--hidden", options->hidden, "effect that the twin hides, or none (default: by chance)")
        ->type_name("EFFECT");
    sub->add_option("--seed", options->seed, "of the random numbers (default: another one each time)")->type_name("N");
    sub->add_option("--out", options->out, "folder for recording and models (default: demo-out)")->type_name("DIR");
  }

  void add_new() {
    const auto [sub, options] = command<NewOptions>("new");
    sub->add_option("--from", options->data.data, kDataHelp)->required()->type_name("DATA");
    take_new(*sub, *options);
    take_tolerate(sub, options->data);
  }

  void add_check() {
    const auto [sub, options] = command<CheckOptions>("check");
    take_data(sub, options->data);
    take_pipeline(sub, options->pipeline);
  }

  void add_effects() {
    const auto [sub, options] = command<EffectsOptions>("effects");
    sub->add_option("NAME", options->name, "the effect to explain")->type_name("");
  }

  void add_measure() {
    const auto [sub, options] = command<MeasureOptions>("measure");
    take_data(sub, options->data);
    sub->add_option("--period-s", options->period_s, "period of the excitation (default: found in the data)")
        ->check(CLI::PositiveNumber)
        ->type_name("S");
  }

  void add_identify() {
    const auto [sub, options] = command<IdentifyOptions>("identify");
    take_data(sub, options->data);
    take_model(sub, options->model);
    sub->add_option("--out", options->out, "the model with the values in it (default: print only)")->type_name("MODEL");
    sub->add_option(
           "--method", options->method,
           "ls: least squares; nls: with a search for nonlinear parameters; partitioned: linear parameters first, then "
           "the others; iv: instrumental variables, for noisy velocities; oe: least error of the free run (default: "
           "ls or nls, as the model needs)")
        ->check(CLI::IsMember({"ls", "nls", "partitioned", "iv", "oe"}))
        ->type_name("");
    sub->add_option(
           "--intervals", options->intervals,
           "standard; profile: where the best fit of all others gets significantly worse; bootstrap: from samples "
           "drawn again (ls and nls)")
        ->check(CLI::IsMember({"standard", "profile", "bootstrap"}))
        ->capture_default_str()
        ->type_name("");
    sub->add_option(
           "--supply", options->supply,
           "a parameter that is known from another source, in its SI unit, as inertia.inertia=1.07e-4; may be repeated")
        ->type_name("EFFECT.PARAMETER=VALUE")
        ->allow_extra_args(false);
    sub->add_option("--starts", options->starts, "starts of the search for nonlinear parameters")
        ->check(CLI::Range(1, 100))
        ->capture_default_str()
        ->type_name("N");
    sub->add_option("--seed", options->seed, "of the random starts and of the bootstrap")
        ->capture_default_str()
        ->type_name("N");
    take_holdout(sub, options->data);
    take_report(sub, options->report);
    take_pipeline(sub, options->pipeline);
  }

  void add_simulate() {
    const auto [sub, options] = command<SimulateOptions>("simulate");
    take_data(sub, options->data);
    take_model(sub, options->model);
    sub->add_option("--out", options->out, "folder for the simulated measurements")->required()->type_name("DIR");
  }

  void add_compare() {
    const auto [sub, options] = command<CompareOptions>("compare");
    take_data(sub, options->data);
    take_model(sub, options->model);
    take_holdout(sub, options->data);
    sub->add_option("--limit", options->limits, "exit code 1 if a signal's error is above this; may be repeated")
        ->type_name("SIGNAL=RMSE")
        ->allow_extra_args(false);
    sub->add_option(
           "--beside", options->baselines,
           "a black box to compare the model with: fir:N, arx:NA,NB,NK, or fir:auto, arx:auto; may be repeated")
        ->type_name("BOX")
        ->allow_extra_args(false);
    take_report(sub, options->report);
    take_pipeline(sub, options->pipeline);
  }

  void add_diagnose() {
    const auto [sub, options] = command<DiagnoseOptions>("diagnose");
    take_data(sub, options->data);
    take_model(sub, options->model);
    take_holdout(sub, options->data);
    sub->add_flag("--auto", options->all, "continue with the named effect added, until no more is found");
    take_report(sub, options->report);
    take_pipeline(sub, options->pipeline);
  }

  void add_add() {
    const auto added = command<AddOptions>("add");
    take_change(added,
                "effect of the catalogue; torque_ripple:2 gives an order; table_effect:velocity learns a curve over a "
                "signal, table_effect:torque*direction one times the direction; expression_effect takes --formula");
    const auto [sub, options] = added;
    sub->add_option("--formula", options->user_defined.formula,
                    "torque of an expression_effect, over signals and parameters")
        ->type_name("TEXT");
    sub->add_option("--parameter", options->user_defined.parameters,
                    "of the formula, with bounds where it does not only scale the torque; may be repeated")
        ->type_name("NAME=LOW..HIGH:UNIT")
        ->allow_extra_args(false);
    sub->add_option("--points", options->user_defined.points, "of a table_effect (default: chosen from the data)")
        ->type_name("N");
    sub->add_option(
           "--balance", options->user_defined.balance,
           "of a table_effect or expression_effect: motor, transmission or load; else where its signals belong")
        ->type_name("NAME");
  }

  template <class Command>
  void take_change(const Command& change, const std::string& effect_help) {
    const auto& [sub, options] = change;
    sub->add_option("EFFECT", options->effect, effect_help)->required()->type_name("");
    take_data(sub, options->data);
    take_model(sub, options->model);
    sub->add_option("--out", options->out, "the changed model")->required()->type_name("OUT");
    take_holdout(sub, options->data);
    take_report(sub, options->report);
    take_pipeline(sub, options->pipeline);
  }

  void add_sensitivity() {
    const auto [sub, options] = command<SensitivityOptions>("sensitivity");
    take_data(sub, options->data);
    take_model(sub, options->model);
    sub->add_flag("--refit", options->refit,
                  "re-estimate the remaining parameters each time: the error that the other effects cannot compensate");
    sub->add_option("--scale", options->scale, "scale a parameter, too; may be repeated")
        ->type_name("EFFECT.PARAMETER=FACTOR")
        ->allow_extra_args(false);
    take_holdout(sub, options->data);
    take_pipeline(sub, options->pipeline);
  }

  void add_export() {
    const auto [sub, options] = command<ExportCommandOptions>("export");
    sub->add_option("--model", options->model, "model file")->type_name("MODEL");
    sub->add_flag("--protocol-header", options->protocol_header,
                  "no model, but messages and parameter block of a drive as a C header");
    sub->add_option("--as", options->as, "c: a C header; csv: tables; mujoco, urdf: a joint for a physics engine")
        ->check(CLI::IsMember({"c", "csv", "mujoco", "urdf"}))
        ->type_name("");
    sub->add_option("--out", options->out, "the file, or the folder of tables (default: print; csv needs it)")
        ->type_name("PATH");
  }

  void add_pack() {
    const auto [pack, options] = command<PackCommandOptions>("pack");
    take_model(pack, options->model);
    pack->add_option("--out", options->out, "the parameter block")->required()->type_name("BLOCK");
    pack->add_option("--tick-hz", options->pack.tick_hz, "ticks of the drive's control loop a second")
        ->capture_default_str()
        ->type_name("HZ");
    pack->add_option("--bound", options->pack.bound, "largest error against double, as a share of rated torque")
        ->check(CLI::PositiveNumber)
        ->capture_default_str()
        ->type_name("SHARE");
    pack->add_flag("--measured", options->pack.measured,
                   "where the error cannot be proven, take the largest one along samples of the envelope");
    pack->add_option("--drive", options->drive, "settings of the drive: its loops, limits and sensors")
        ->type_name("FILE.toml");
    pack->add_option("--for-drive", options->for_drive,
                     "a drive in reach: its tick rate, the effects of its image, and full scales, largest current and "
                     "sensors of its board, which the settings then need not state")
        ->type_name("DRIVE");
    pack->add_option("--drive-name", options->pack.drive, "name of the drive that the block is for (default: any)")
        ->type_name("NAME");
    pack->add_option("--encoder-counts", options->pack.encoder_counts,
                     "per motor turn: the block then has an encoder filter")
        ->type_name("COUNTS");
    pack->add_option("--filter-corner-hz", options->pack.filter_corner_hz, "corner of the encoder filter")
        ->check(CLI::PositiveNumber)
        ->capture_default_str()
        ->type_name("HZ");
    pack->add_option("--image", options->pack.image, "effects that the firmware has (default: all that can run)")
        ->type_name("EFFECT")
        ->delimiter(',')
        ->allow_extra_args(false);
    const auto [unpack, unpack_options] = command<UnpackOptions>("unpack");
    unpack->add_option("BLOCK", unpack_options->block, "parameter block")->required()->type_name("");
    unpack->add_option("--out", unpack_options->out, "the model that the block was made from (default: print only)")
        ->type_name("MODEL");
  }

  void add_plan() {
    const auto [sub, options] = command<PlanOptions>("plan");
    sub->add_option("DATA", options->data.data, fmt::format("what there is already: {}", kDataHelp))->type_name("");
    take_tolerate(sub, options->data);
    take_model(sub, options->model);
    sub->add_option("--out", options->out, "the plan")->required()->type_name("PLAN");
    sub->add_option("--separate", options->separate, "two effects to distinguish (default: what is not well known)")
        ->delimiter(',')
        ->expected(2)
        ->type_name("A,B");
    const auto limit = [sub = sub](const char* name, std::optional<double>& value, const char* help, const char* unit) {
      sub->add_option(name, value, help)->check(CLI::PositiveNumber)->type_name(unit);
    };
    limit("--current-a", options->current_a, "largest motor current (default: the model's rated one)", "A");
    limit("--velocity-rad-s", options->velocity_rad_s, "largest motor velocity (default: the model's rated one)",
          "RAD/S");
    limit("--travel-rad", options->travel_rad, "travel of the output from end to end (default: one turn)", "RAD");
    limit("--duration-s", options->duration_s, "of all recordings together (default: 180)", "S");
    limit("--load-torque-nm", options->load_torque_nm,
          "constant torque that you can apply to the output (default: what half of the current holds)", "NM");
    limit("--run-s", options->run_s, "of one recording (default: 8)", "S");
    limit("--sample-hz", options->sample_hz, "rate of the recording (default: that of DATA, else 1000)", "HZ");
    sub->add_option("--without", options->without, "what you cannot do: off, locked, load, temperature")
        ->delimiter(',')
        ->check(CLI::IsMember({"off", "locked", "load", "temperature"}))
        ->type_name("WHAT");
    sub->add_option("--temperatures", options->temperatures_c, "housing cold and warm, degC (default: 25,40)")
        ->delimiter(',')
        ->expected(2)
        ->type_name("COLD,WARM");
    sub->add_option("--motions", options->motions, "at most so many")
        ->check(CLI::Range(1, 20))
        ->capture_default_str()
        ->type_name("N");
    take_pipeline(sub, options->pipeline);
  }

  void add_drive_commands() {
    const auto [drives, drives_options] = command<DrivesOptions>("drives");
    drives
        ->add_option("--also", drives_options->also,
                     "search here, too: serial:PORT, tcp:HOST:PORT/TOKEN; may be repeated")
        ->type_name("DRIVE")
        ->allow_extra_args(false);
    const auto [flash, flash_options] = command<FlashOptions>("flash");
    take_drive(flash, flash_options->drive);
    flash->add_option("--model", flash_options->model, "model file, packed for this drive")->type_name("MODEL");
    flash->add_option("--block", flash_options->block, "parameter block of pack or backup")->type_name("BLOCK");
    flash
        ->add_option("--settings", flash_options->settings,
                     "of the drive, as pack --drive takes them (default: those of its active block)")
        ->type_name("FILE.toml");
    take_firmware(*flash, *flash_options);
    take_prediction(flash, *flash_options);
    take_yes(flash, flash_options->yes);
    take_image(command<ImageOptions>("image"));
    take_sign(command<SignOptions>("sign"));
    take_key(command<KeyOptions>("key"));
    const auto [backup, backup_options] = command<BackupOptions>("backup");
    take_drive(backup, backup_options->drive);
    backup->add_option("--out", backup_options->out, "file for the block")->required()->type_name("BLOCK");
    backup->add_flag("--previous", backup_options->previous, "the block before the active one");
    const auto [restore, restore_options] = command<RestoreOptions>("restore");
    take_drive(restore, restore_options->drive);
    take_restore(restore, *restore_options);
    const auto [home, home_options] = command<HomeOptions>("home");
    take_drive(home, home_options->drive);
    take_home(home, *home_options);
    const auto [monitor, monitor_options] = command<MonitorOptions>("monitor");
    take_monitor(monitor, *monitor_options);
    const auto [record, record_options] = command<RecordOptions>("record");
    take_record(record, *record_options);
    const auto [twin, twin_options] = command<TwinOptions>("twin");
    take_twin(twin, *twin_options);
  }

  void add_manual() {
    const auto [completion, completion_options] = command<CompletionOptions>("completion");
    take_manual(completion, *completion_options);
    const auto [man, man_options] = command<ManOptions>("man");
    completion_options->tree = man_options->tree = [this] { return option_tree_of(app_); };
  }

  void add_workbench() {
    const auto [sub, options] = command<WorkbenchOptions>("workbench");
    sub->add_option("DATA", options->data.data, kDataHelp)->type_name("");
    take_tolerate(sub, options->data);
    sub->add_option("--model", options->model, "model file (default: a first one, from what is chosen on the page)")
        ->type_name("MODEL");
    take_workbench(*sub, *options);
    take_holdout(sub, options->data);
    take_pipeline(sub, options->pipeline);
  }

  CLI::App app_;
  ChosenCommand chosen_;
};

}  // namespace

int run(int argc, char** argv) {
  return App().run(argc, argv);
}

}  // namespace flexspline::cli
