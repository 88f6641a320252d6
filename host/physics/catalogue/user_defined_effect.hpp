// User-defined effects: a table over a signal, or a formula. What they compute is given in the model file, so each is
// an entry of its own, built at its first use and cached.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/physics/catalogue/catalogue.hpp"
#include "host/physics/model/model.hpp"
#include "shared/effects/variables.hpp"

namespace flexspline::catalogue {

inline constexpr std::string_view kTableEffect = "table_effect";
inline constexpr std::string_view kExpressionEffect = "expression_effect";

// The description of the two; null if the name is neither.
const effects::Description* description_of(std::string_view name);

// The entry of an effect of a model: the catalogue's, or its own for a user-defined effect. Valid until the program
// ends. Throws model::ModelError where it cannot be used, std::out_of_range where there is no effect of that name.
const Entry& entry_of(const model::Effect& effect);

// The parameters of a table as its coefficients are derived from them: those that are stated, then the values.
std::vector<double> table_parameters(const model::Definition& definition);

// What is wrong with a user-defined effect; nothing where `entry_of` takes it.
std::optional<model::Objection> objection_to(const model::Effect& effect);

// Names of its parameters that have no value, in the order of the catalogue; "table" where a table has none.
std::vector<std::string> missing_values(const model::Effect& effect);

// Null if there is no signal of that name.
const effects::VariableInfo* find_variable(std::string_view name);
// "velocity, speed, ...".
std::string variable_names();

inline constexpr std::size_t kMostPoints = 256;
inline constexpr std::size_t kFewestPoints = 2;
// `count` even steps from `low` to `high`, or over a turn, of which the end is the beginning.
std::vector<double> even_points(double low, double high, std::size_t count);
std::vector<double> points_of_turn(std::size_t count);

// The torque of an effect on its own balance at each value `x` of one signal (in its unit), all other signals at zero
// and all directions as given: for plots, and for folding an effect that depends on one signal into a table. The speed
// is the magnitude of the velocity. Takes effects without memory that add a torque.
std::vector<double> torque_over(const Entry& entry, std::span<const double> parameters,
                                const DriveConstants<double>& drive, effects::Variable variable,
                                std::span<const double> x, double direction = 1.0);

// The signal on which alone an effect's torque on its balance depends for signals of up to about `scale` times the
// usual ones, and whether it changes its sign with the direction; nothing where it depends on none, on more, or on what
// was before. Such an effect is a table: see torque_over.
struct SingleVariable {
  effects::Variable variable{};
  bool times_direction = false;
};
std::optional<SingleVariable> single_variable(const Entry& entry, std::span<const double> parameters,
                                              const DriveConstants<double>& drive, double scale = 1.0);

}  // namespace flexspline::catalogue
