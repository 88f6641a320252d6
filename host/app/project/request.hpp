// What a first project is made from.
#pragma once

#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexspline::project {

struct Request {
  std::vector<std::filesystem::path> data;
  std::vector<std::string> tolerate;  // kinds of findings that are only warnings
  std::filesystem::path out;          // folder of the project; names the model
  std::vector<std::string> map;       // OURS=THEIRS[:UNIT]
  std::vector<std::string> without;   // columns of theirs that are not used, whatever their names say
  std::vector<std::string> turned;    // columns of ours whose sign is the other one
  std::string axis;                   // empty: guessed
  std::string load;                   // of the output: free, locked; empty: as the files state
  std::string position_side;          // "link", "motor"; empty: guessed
  std::optional<int> pole_pairs;
  std::optional<int> joint;  // of a file with several
  std::optional<double> gear_ratio;
  std::optional<double> torque_constant_nm_a;
  std::optional<double> encoder_counts;
  std::optional<double> pitch_m;  // of a linear axis: travel of one motor turn
};

// What is requested does not fit together, or a question is open: "what; what to do".
class RequestError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace flexspline::project
