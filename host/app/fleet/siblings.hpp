// Many drives of one kind, each with what was found of it: which differs from its siblings, and in what.
#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexspline::fleet {

// No file of results, or one that is damaged: where and what to do. Exit 2.
class FleetError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

inline constexpr const char* kResultName = "fleet-result.json";
inline constexpr const char* kResultFormat = "flexspline-fleet-drive/1";
// Fewer siblings do not show which one differs.
inline constexpr std::size_t kFewestDrives = 5;

// A parameter, or the error of a fitted balance ("error of motor_balance").
struct Quantity {
  std::string name;
  std::string unit;
  double value = 0.0;
  std::optional<double> std;  // of the value itself, where known
};

struct DriveResult {
  std::string drive;
  std::filesystem::path file;
  std::string failed;  // why there is no result; empty: there is
  std::vector<Quantity> quantities;
  std::string verdict;             // of the diagnosis; empty: it was not asked for
  std::vector<std::string> named;  // effects
};

// From "flexspline-fleet-drive/1". Throws FleetError.
DriveResult result_from(const nlohmann::json& json, const std::filesystem::path& file);
// Files as they are; of a folder its own result, or those of the folders and *.json files in it, by name. A folder with
// measurements and without a result counts as a drive that failed: its job was killed or never ran. Throws FleetError
// where there is no result at all or one cannot be read.
std::vector<DriveResult> read_results(const std::vector<std::filesystem::path>& places);

// How a quantity is distributed over the drives that have it.
struct Spread {
  std::string name;
  std::string unit;
  std::size_t drives = 0;
  double median = 0.0;
  double deviation = 0.0;  // 1.4826 times the median distance from the median: a standard deviation that no single
                           // drive can move (Rousseeuw and Croux, 1993)
};
// A drive beyond the limit in one quantity.
struct Difference {
  std::string drive;
  std::string name;
  std::string unit;
  double value = 0.0;
  double median = 0.0;
  double deviation = 0.0;  // that it was compared with: the siblings', or the value's own where that is larger
  double z = 0.0;          // (value - median) / deviation
};
struct Merged {
  std::vector<Spread> spreads;
  std::vector<Difference> differences;       // largest first
  std::vector<const DriveResult*> verdicts;  // of drives whose diagnosis differs from that of most
  std::string usual_verdict;                 // empty where no diagnosis was made
  std::vector<const DriveResult*> failed;
  double limit = 0.0;
};

// Compares drives that have results. `limit`: of |z|; else that which one fleet in a hundred of Gaussian siblings, as
// large as this one and with as many quantities, would exceed (simulated, with a fixed seed). The results have to
// outlive the answer.
Merged merge(const std::vector<DriveResult>& results, std::optional<double> limit = std::nullopt);

// That limit. `drives` at least 3.
double usual_limit(std::size_t drives, std::size_t quantities);

}  // namespace flexspline::fleet
