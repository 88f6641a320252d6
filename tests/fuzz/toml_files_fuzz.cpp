// All files of TOML that people write for the tool and the twin: refused with file and line, or read; and what was read
// and can be written comes back the same.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "hil/plant/parameters.hpp"
#include "hil/scenario/scenario_file.hpp"
#include "host/common/text/toml.hpp"
#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/drive_settings.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/engine/planning/plan.hpp"
#include "host/input/data/dataset_toml.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "host/physics/model/model.hpp"
#include "tests/fuzz/readers.hpp"

namespace {

using namespace flexspline;
using tests::require;

constexpr const char* kName = "that.toml";

// An error of a file begins with its name.
void require_place(const std::exception& error) {
  require(std::string_view(error.what()).starts_with(kName),
          "an error without its place: " + std::string(error.what()));
}

// Positions are in the text, and what stands inside of another does so.
void require_positions(const text::Node& node, std::size_t size) {
  require(node.span.begin <= node.span.end && node.span.end <= size && node.line >= 1,
          "a position outside of the text");
  for (const text::Entry& e : node.entries) {
    require(e.key_span.begin <= e.key_span.end && e.key_span.end <= size, "a key outside of the text");
    require_positions(e.value, size);
  }
  for (const text::Node& item : node.items) require_positions(item, size);
}

void read_tree(const std::string& text) {
  try {
    require_positions(text::parse_toml(text), text.size());
  } catch (const text::TomlError& error) {
    require(error.line() >= 1, "an error without a line");
  }
}

void read_model(const std::string& text) {
  model::ModelFile file;
  try {
    file = model::parse(text, kName, catalogue::known_effects());
  } catch (const model::ModelError& error) {
    return require_place(error);
  }
  // It checks itself that what it writes reads as what it was given, and says so where it does not.
  const std::string again = model::rewrite(file, file.model);
  const model::ModelFile back = model::parse(again, kName, catalogue::known_effects());
  require(model::rewrite(back, back.model) == again, "a second rewrite changes something");
  model::parse(model::write(file.model), kName, catalogue::known_effects());
}

void read_plan(const std::string& text) {
  try {
    const planning::Plan plan = planning::parse(text, kName);
    const std::string written = planning::text_of(plan);
    require(planning::text_of(planning::parse(written, kName)) == written, "a plan does not come back");
  } catch (const planning::PlanError& error) {
    require_place(error);
  }
}

void read_dataset(const std::string& text) {
  static const tests::ScratchFolder folder;
  const std::filesystem::path file = folder.write("dataset.toml", text);
  data::Findings findings;
  try {
    data::read_dataset_toml(file, findings);
    findings.throw_if_errors();
  } catch (const data::DataError& error) {
    for (const data::Finding& f : error.findings()) require(!f.what.empty(), "a finding says nothing");
  }
}

const model::Model& some_model() {
  static const model::Model model = [] {
    return model::parse(tests::kBeginningOfModel + R"([[effect]]
type = "linear_stiffness"
parameters.stiffness = 6300
[[effect]]
type = "output_inertia"
parameters.inertia = 0.06
)",
                        "model", catalogue::known_effects())
        .model;
  }();
  return model;
}

void read_settings(const std::string& text) {
  static const auto bases = deployment::bases_of(some_model(), 1.0 / 20'000.0);
  try {
    const auto setup = deployment::parse_drive_setup(text, kName, some_model(), bases);
    const auto settings = deployment::settings_of(setup, bases, kName);
    require(!deployment::described(settings, bases).empty(), "settings that say nothing");
  } catch (const deployment::PackError& error) {
    require_place(error);
  }
}

template <class Read>
void read_twins(const std::string& text, Read read) {
  try {
    read(text, kName);
  } catch (const std::runtime_error& error) {
    require_place(error);
  }
}

}  // namespace

// The first byte says whose file it is.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const std::string text(reinterpret_cast<const char*>(bytes) + 1, size - 1);
  switch (bytes[0] % 8) {
    case 0:
    case 1:
      read_model(text);
      break;
    case 2:
      read_plan(text);
      break;
    case 3:
      read_dataset(text);
      break;
    case 4:
      read_settings(text);
      break;
    case 5:
      read_twins(text, plant::parse_plant);
      break;
    case 6:
      read_twins(text, scenario::parse_scenario);
      break;
    default:
      read_tree(text);
  }
  return 0;
}
