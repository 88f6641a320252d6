// Recordings of the twin in the place of the report's experiments, and simulations of the report's own blocks with the
// measured current, as its section 5 does it.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "hil/plant/recorder.hpp"
#include "hil/rhs100/experiments.hpp"
#include "hil/thesis_figures/plot.hpp"
#include "hil/thesis_models/drive_system.hpp"

namespace flexspline::thesis_figures {

inline constexpr double kHz = 1e3;         ///< sample rate of all recordings
inline constexpr double kCutoffHz = 20.0;  ///< of what is drawn, through zero_phase

/// An experiment of a set by its name. Throws std::invalid_argument where there is none.
plant::Record twin_record(const rhs100::Set& set, std::string_view name, std::uint64_t seed);

/// The drive of the averages (eq. 79, tables 7 and 8) in a motion that no table has.
plant::Record twin_record(const plant::ExperimentPlan& plan, std::uint64_t seed);
plant::ExperimentPlan free_sine(double amplitude_rad_s, double frequency_hz);
plant::ExperimentPlan locked(plant::Waveform waveform, double share, double frequency_hz);

/// Averages of tables 7 and 8, eq. 79.
report::DriveSystemParts nominal_parts();

/// The report's blocks under the measured current, held from sample to sample, from the measured start; steps of 1 ms,
/// the implicit friction block: the report's layer creeps at rest, and its explicit steps do not survive the infinite
/// slope of the damping at rest (see hil/thesis_models/README.md).
report::SystemTrace simulate(const report::DriveSystemParts& parts, const plant::Record& measured);

std::vector<double> input_velocity(const report::SystemTrace& trace);

/// A fifth-order Butterworth filter forward and backward (the report's footnote 1) at `cutoff_hz`.
std::vector<double> zero_phase(std::vector<double> signal, double cutoff_hz, double sample_hz);

/// The samples from `from_s` to `to_s`.
Curve part(std::string label, const plant::Record& record, const std::vector<double>& signal, double from_s,
           double to_s, Stroke stroke);

}  // namespace flexspline::thesis_figures
