// The residual map of a drive: where, over velocity and motor angle, its model fails, and how certain that is.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "host/drive_link/drive/pairing.hpp"
#include "host/drive_link/drive/scales.hpp"
#include "host/drive_link/drive/session.hpp"

namespace flexspline::drive {

struct ResidualBin {
  std::uint32_t ticks = 0;
  double mean_nm = 0.0;  // measured less modelled torque of the motor; zero where ticks are
  double std_nm = 0.0;   // of single ticks
};
struct ResidualMap {
  bool is_linear = false;           // an axis in m/s and N
  bool counts = false;              // it grows while it is read
  bool of_one_moment = false;       // nothing was counted between its first and its last bin
  double tick_s = 0.0;              // from one residual that is counted to the next
  std::size_t angle_bins = 0;       // of a turn, from zero
  std::vector<double> edges_rad_s;  // of a direction, rising; the bin in the middle is below the first
  double unit_nm = 0.0;             // steps in which the drive counts
  std::vector<ResidualBin> bins;    // velocity bin times angle_bins + angle bin; first the fastest backwards

  std::size_t velocity_bins() const { return 2 * edges_rad_s.size() + 1; }
  const ResidualBin& at(std::size_t velocity, std::size_t angle) const { return bins[velocity * angle_bins + angle]; }
  // Of a velocity bin, rad/s, signed, low < high; the fastest ones end at infinity.
  struct Range {
    double low = 0.0, high = 0.0;
  };
  Range velocity(std::size_t bin) const;
  double seconds() const;  // that it holds
};

// Throws DriveError where the firmware is too old for it or there are no parameters.
ResidualMap read_residual_map(Session& session, const Scales& scales);
// Starts counting where it does not, from an empty map: what was counted before may be of another block. Returns
// whether it had to. `signer`: of a drive that is paired.
bool start_residual_map(Session& session, const std::optional<PairingSigner>& signer = {});
// Empties it; it counts on as before. The drive refuses that while it is armed.
void reset_residual_map(Session& session, const std::optional<PairingSigner>& signer = {});

// An error of the model that a map shows.
struct MapFinding {
  int order = 0;                  // of the motor's turn; zero: a torque over velocity
  ResidualMap::Range velocity{};  // of an order: the whole range that was tested
  double size_nm = 0.0;           // mean of the residual (signed), or amplitude of the order
  double std_nm = 0.0;            // of the size
  double p_value = 1.0;           // that noise alone makes this anywhere in the map: times the tests made
};
enum class MapVerdict : std::uint8_t { too_little_data, model_fits, model_fails };
std::string_view name_of(MapVerdict verdict);
struct MapTest {
  MapVerdict verdict = MapVerdict::too_little_data;
  std::size_t tested_bins = 0;       // of velocity
  std::vector<MapFinding> findings;  // significant and above the limit; the most significant first
};
inline constexpr double kMapCertainty = 1e-3;  // largest p_value of a finding
inline constexpr int kMostMapOrder = 8;
// Residuals closer in time than this count as one: they went through the same filters.
inline constexpr double kIndependent_s = 0.02;

// The mean of each velocity bin is tested against zero (normal), and each order up to kMostMapOrder over all velocity
// bins together (chi squared of twice as many degrees of freedom), with the scatter inside of the bins as noise and by
// Bonferroni for the number of tests. What is smaller than `limit_nm` is no finding. Standstill is not tested.
MapTest test_map(const ResidualMap& map, double limit_nm);

}  // namespace flexspline::drive
