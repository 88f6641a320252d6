// A model of a drive: what is known of it, and the effects on its torque balances with their parameters.
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/dataset.hpp"
#include "host/physics/model/known_effects.hpp"

namespace flexspline::model {

struct Quantity {
  std::optional<double> value;
  std::string source;  // "report, table 3"; empty where the file does not say
};

// Known, not identified. Base of the friction law's reference velocity and of per-unit numbers.
struct Drive {
  data::Axis axis = data::Axis::rotary;
  Quantity gear_ratio;
  Quantity torque_constant_nm_a;
  Quantity rated_current_a;
  Quantity rated_velocity_rad_s;
  Quantity rated_torque_nm;
  Quantity temperature_reference_c;
  Quantity pitch_m;      // linear axis: travel of one motor turn
  Quantity pole_pairs;   // of the motor; a whole number
  Quantity motor_slots;  // of its stator; a whole number
};

struct Parameter {
  std::string name;  // key of the catalogue: "torque"
  std::optional<double> value;
  std::string unit;
  std::optional<double> std;
  std::optional<double> spread_percent;
  bool fixed = false;
  // Bounds of a user-defined parameter; those of the catalogue are in the catalogue.
  std::optional<double> low{};
  std::optional<double> high{};
};

// A torque by points over one signal.
struct Table {
  std::vector<double> at;     // the signal, in even steps
  std::vector<double> value;  // torque, on the effect's balance; empty: to be identified
  std::vector<double> std;    // of each value; may be empty
  bool fixed = false;         // is not estimated
};

// What an effect computes, where its type leaves that to the user.
struct Definition {
  std::string balance = "motor";  // "motor", "transmission", "load"
  std::string variable;           // of a table: the signal that it runs over
  bool times_direction = false;   // of a table: times the sign of the motion on its balance
  Table table;
  std::string formula;  // of a formula: its torque
};

struct Effect {
  std::string type;  // name in the catalogue
  std::string id;    // unique in the model; the type unless the file says otherwise
  // In the order of the catalogue, all that the catalogue has, with no value where the file has none.
  // Of a user-defined effect, those of the file.
  std::vector<Parameter> parameters;
  std::optional<Definition> definition{};  // of a user-defined effect

  const Parameter* find(std::string_view name) const;
  Parameter* find(std::string_view name);
};

struct History {
  std::string action;  // "add", "remove"
  std::string effect;
  std::optional<double> rmse_before;
  std::optional<double> rmse_after;
};

struct Model {
  std::string name;
  Drive drive;
  std::vector<Effect> effects;
  std::vector<History> history;

  const Effect* find(std::string_view id) const;
  Effect* find(std::string_view id);
};

// What is wrong with a model file: file, line and what to do are in the text. Exit 2.
class ModelError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// A model and the text that it came from, so that a rewrite changes values in place and keeps all else.
struct ModelFile {
  Model model;
  std::string text;
};

// Reads a model file. Unknown effects, unknown or missing parameters of an effect, values outside their bounds and a
// wrong format are a ModelError with file, line, what is known instead and what to do. Units are those of the axis; a
// value that is outside its bounds by no more than the rounding of a written number is taken as the bound.
ModelFile read(const std::filesystem::path& path, const KnownEffects& known);
// The same from a text; `file_name` is only for messages.
ModelFile parse(std::string text, std::string_view file_name, const KnownEffects& known);

// The text of `file` with the values of `changed`: values, std and spread are replaced in place, missing ones
// inserted, those that are no longer known taken out, new effects and history appended, removed effects cut out with
// the comments directly above; comments, key order and the text of unchanged numbers stay. Effects are matched by id;
// their order in `changed` does not matter. Values are written with 6 significant digits (stated ones, in [drive] or
// fixed, exactly), std and spread with 3; an std or spread that is not finite counts as not known. A `file` without
// text is written again. Throws std::logic_error where the result would not read back as `changed`: a value that is not
// finite, a history that is not a continuation of the file's.
std::string rewrite(const ModelFile& file, const Model& changed);

// A new file for a model that came from none, with short comments. Throws std::logic_error as `rewrite` does.
std::string write(const Model& model);

// Atomic: written to a temporary file in the same folder, then renamed. Throws ModelError with path and reason; a file
// that was there before is unchanged then.
void save(const std::filesystem::path& path, const std::string& text);

}  // namespace flexspline::model
