// The regression that a diagnosis searches: target, columns of the model, and columns of all terms that may be added,
// at the highest bandwidth and without a mask. Immutable; lower bandwidths and masks are made from its samples.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host/engine/estimation/regression_problem.hpp"
#include "host/engine/estimation/terms.hpp"
#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/presliding.hpp"

namespace flexspline::selection {

using estimation::Balance;

// A term that may be added, at one value of its nonlinear parameters.
struct CandidateTerm {
  const catalogue::Entry* entry = nullptr;  // null: a placebo order or a curve that is in no catalogue
  std::optional<double> order;
  // "torque_ripple:2"; the same for all values of its nonlinear parameters, and for laws of one family.
  std::string name;
  std::vector<double> values;  // as estimation::Term has them, where there is an entry
  std::vector<Eigen::Index> columns;
  std::vector<double> low;       // of each column's coefficient
  std::vector<double> high;      // likewise, where it has one
  bool sum_is_positive = false;  // of the coefficients: amplitudes of a law that may differ by direction
  double most_at_peak = 0.0;     // largest coefficient that is plausible; 0: any
  bool is_placebo = false;
  bool is_delayed = false;    // a wave with the slopes of its columns, too: with a delay between effort and motion
  std::size_t nonlinear = 0;  // parameters that were searched over
  double highest_hz = 0.0;    // the bandwidth must reach that far for it to be seen
  // Terms of which this is what an error of the phase leaves, or the reverse: not both are chosen.
  std::vector<std::string> excludes;
};

// Consecutive samples of one record, evenly spaced in time.
struct Run {
  std::size_t record = 0;
  Eigen::Index first = 0, last = 0;
  double row_s = 0.0;
};

enum class SampleState : std::uint8_t { in_motion, near_reversal, at_rest };

// What a table says of its samples, whatever its columns are.
struct TableSamples {
  Eigen::VectorXd target;  // N m
  std::vector<Run> runs;
  std::size_t records = 0;
  std::vector<std::uint8_t> held_out;  // by record: not fitted on and not chosen with
  double highest_hz = 0.0;             // of the samples
  double highest_law_hz = 0.0;         // of the motion: wider bandwidths serve waves over the motor's angle alone
  // For masks, by sample: velocity over its noise; of a table at one bandwidth (filtered_table), the states instead.
  Eigen::VectorXd velocity_over_noise;
  std::vector<SampleState> states;
  double reversals = 0.0;
};

// The columns of the model that terms are added to.
struct TableModel {
  Eigen::Index model_columns = 0;
  std::vector<std::string> model_names;  // "coulomb_friction.torque"
  std::vector<double> model_low;         // lower bound of each model column's coefficient
};

enum class Direction { sign, presliding };

// What a table has where a state of presliding is in the place of the sign of the velocity.
struct PreslidingColumns {
  std::vector<Eigen::Index> instead_of;  // columns of the table that differ there
  // In their place, scaled as they are; then dry friction over the states of PreslidingTravels::shape less that of the
  // law, scaled to unit root mean square: fitted with the term of presliding.
  Eigen::MatrixXd columns;
  Eigen::VectorXd target;
};

struct RegressorTable : TableSamples, TableModel {
  Eigen::MatrixXd columns;  // those of the model first; N m per unit, scaled to unit root mean square
  Eigen::VectorXd scale;    // root mean squares that the columns were divided by
  std::optional<PreslidingColumns> presliding;  // nothing: it cannot be shown
  // Places of the shape of presliding: behind the columns.
  std::vector<Eigen::Index> presliding_shape() const;
  // Friction that may differ from run to run, by surface in common and by direction: columns of a relative change of
  // one.
  std::vector<Eigen::Index> differences;
  std::vector<CandidateTerm> terms;
  std::vector<const catalogue::Entry*> not_visible;  // that these data could not show if they were there
  // Effects and orders that do not compete, as other orders take more off what the model leaves.
  std::vector<std::pair<const catalogue::Entry*, double>> smaller_waves;
};

// `prepared` is at the highest bandwidth and not masked; `terms` have the values of a first fit. Without `travels` no
// state of presliding competes with the sign of the velocity.
RegressorTable make_regressor_table(const estimation::PreparedData& prepared, Balance balance,
                                    const estimation::Terms& terms, const std::optional<PreslidingTravels>& travels,
                                    double highest_law_hz, const SelectionPolicy& policy);

// Some columns of a table: what it says of them, and their places in it.
struct ChosenColumns {
  RegressorTable table;                           // of these columns, without samples
  std::vector<Eigen::Index> columns, presliding;  // in the table, and in its columns with presliding
};
// Those of the model, of friction that may differ, and of these terms (places in table.terms), in their order.
// `presliding`: with what is in their place there, if the table has it.
ChosenColumns choose_columns(const RegressorTable& table, const std::vector<int>& terms, bool presliding = true);
ChosenColumns all_columns(const RegressorTable& table);

// Highest frequency of an order of the motor's turn that counts, Hz, at the typical speed.
double highest_order_hz(const estimation::PreparedData& prepared);
// The highest order that is tried: those that pole pairs and slots of the motor give may be beyond the policy's.
double highest_order(const model::Drive& drive);

}  // namespace flexspline::selection
