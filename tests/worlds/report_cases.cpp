// flexspline_report_cases OUT_DIR [SEED]: the data of the report's tables 4, 6, 7 and 8 as folders that the tool can
// read, each table as a whole (OUT_DIR/table-7) and each of its rows alone (OUT_DIR/table-7-rows/50-1-02).
#include <fmt/format.h>

#include <exception>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "hil/rhs100/data_set.hpp"
#include "hil/rhs100/experiments.hpp"

namespace {

namespace fs = std::filesystem;
namespace rhs100 = flexspline::rhs100;

// The seed of the tests in tests/report.
constexpr unsigned long long kSeed = 7001;

void write_row(const fs::path& table, const rhs100::Set& set, const rhs100::Experiment& row, const fs::path& folder) {
  const std::string& name = row.plan.name;
  const bool locked = set.sensors == rhs100::Sensors::drive && row.plan.locked;
  fs::create_directories(folder);
  fs::copy_file(table / (name + ".csv"), folder / (name + ".csv"), fs::copy_options::overwrite_existing);
  fs::copy_file(table / "base-model.toml", folder / "base-model.toml", fs::copy_options::overwrite_existing);
  fs::copy_file(table / "truth.toml", folder / "truth.toml", fs::copy_options::overwrite_existing);
  std::ofstream out(folder / "dataset.toml");
  out << fmt::format(
      "format = \"flexspline-dataset/1\"\n\n[drive]\naxis = \"rotary\"\ngear_ratio = {:.6f}\n\n[[experiment]]\n"
      "file = \"{}.csv\"\nname = \"{}\"\nload = \"{}\"\nrole = \"fit\"\n",
      set.gear_ratio, name, name, locked ? "locked" : "free");
  if (!out.flush()) throw std::runtime_error("could not write " + (folder / "dataset.toml").string());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    fmt::print(stderr, "usage: flexspline_report_cases OUT_DIR [SEED]\n");
    return 2;
  }
  try {
    const fs::path out = argv[1];
    rhs100::write_data_set(out, {"table-4", "table-6", "table-7", "table-8"}, argc == 3 ? std::stoull(argv[2]) : kSeed);
    for (const rhs100::Set& set : {rhs100::table_4(), rhs100::table_6(), rhs100::table_7(), rhs100::table_8()})
      for (const rhs100::Experiment& row : set.experiments)
        // The rest of table 4's set is its hold-out and no row of the table.
        if (!row.plan.holdout) write_row(out / set.name, set, row, out / (set.name + "-rows") / row.plan.name);
  } catch (const std::exception& error) {
    fmt::print(stderr, "flexspline_report_cases: {}\n", error.what());
    return 2;
  }
  return 0;
}
