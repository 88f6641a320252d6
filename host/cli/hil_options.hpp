// The options of `flexspline hil`. A template adds them, so that no second file needs the parser.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host/cli/inputs.hpp"
#include "host/closed_loop/page.hpp"

namespace flexspline::cli {

struct HilOptions {
  std::string scenario;
  std::filesystem::path model;  // empty: the data of the drive's manufacturer
  std::filesystem::path base;   // model without the effect that was added; empty: no such run
  std::filesystem::path plant;
  std::filesystem::path settings;
  std::filesystem::path processor;
  std::filesystem::path report;
  std::filesystem::path picture;
  std::vector<std::string> with;
  std::string hide;
  double seconds = 0.0;
  std::uint64_t seed = 1;
  std::uint32_t tick_hz = closed_loop::kTwinTickHz;
  int draws = 8;  // of the prediction; zero: none
  std::string json;
};
int run(const HilOptions& options, Console& console);
// All runs, printed on the console and written to the files that the options name.
closed_loop::Comparison run_closed_loop(const HilOptions& options, Console& console);

template <class Parser>
void take_hil(Parser* sub, HilOptions& options) {
  sub->add_option("--scenario", options.scenario, "name or file; flexspline-hil scenarios lists names")
      ->required()
      ->type_name("S");
  sub->add_option("--model", options.model,
                  "model for the feedforward (default: the manufacturer's values, hidden effect unknown)")
      ->type_name("MODEL");
  sub->add_option("--base", options.base, "model before an effect was added, for one more run")->type_name("MODEL");
  sub->add_option("--plant", options.plant, "plant file of the drive (default: the scenario's)")->type_name("FILE");
  sub->add_option("--with", options.with, "effects that the drive has and the manufacturer's values include, A,B")
      ->delimiter(',')
      ->type_name("EFFECT");
  sub->add_option("--hide", options.hide, "effect that the drive has and the manufacturer's values do not include")
      ->type_name("EFFECT");
  sub->add_option("--settings", options.settings,
                  "settings of the drive, as for pack --drive (default: the manufacturer's)")
      ->type_name("FILE.toml");
  sub->add_option("--seconds", options.seconds, "duration of the motion (default: the scenario's)")->type_name("S");
  sub->add_option("--processor", options.processor, "firmware image that runs the controller, in QEMU")
      ->type_name("ELF");
  sub->add_option("--draws", options.draws, "simulated drives of the prediction; 0: none")
      ->capture_default_str()
      ->type_name("N");
  sub->add_option("--seed", options.seed, "seed of the sensors' noise")->capture_default_str()->type_name("N");
  sub->add_option("--tick-hz", options.tick_hz, "ticks of the drive per second, a multiple of 1000")
      ->capture_default_str()
      ->type_name("HZ");
  sub->add_option("--picture", options.picture, "write the tracking errors as a picture into this file")
      ->type_name("SVG");
  sub->add_option("--report", options.report, "write a page with plots into this file")->type_name("HTML");
}

}  // namespace flexspline::cli
