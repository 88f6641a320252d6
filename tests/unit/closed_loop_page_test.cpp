// The page of a closed loop: when it was made.
#include "host/app/closed_loop/page.hpp"

#include <fmt/chrono.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace flexspline::closed_loop::closed_loop_page_test {
namespace {

// The clock of the process in a zone 14 h ahead of UTC.
class FarZone {
 public:
  FarZone() {
    const char* zone = std::getenv("TZ");
    if (zone != nullptr) before_ = zone;
    set("FAR-14");
  }
  ~FarZone() { set(before_); }
  FarZone(const FarZone&) = delete;
  FarZone& operator=(const FarZone&) = delete;

 private:
  static void set(const std::string& zone) {
    if (zone.empty())
      unsetenv("TZ");
    else
      setenv("TZ", zone.c_str(), 1);
    tzset();
  }
  std::string before_;
};

TEST(ClosedLoopPage, SaysWhenItWasMadeInUtc) {
  const FarZone zone;
  Comparison c;
  c.scenario = "sine";
  c.runs.resize(2);
  for (ComparedRun& run : c.runs) {
    Trace& t = run.outcome.trace;
    t.time_s = t.position_command_rad = t.output_position_rad = t.error_rad = t.motor_velocity_rad_s = t.current_a =
        t.temperature_c = {0.0, 1.0, 2.0};
  }
  const std::filesystem::path file = std::filesystem::temp_directory_path() / fmt::format("closed-{}.html", getpid());
  const std::time_t before = std::time(nullptr);
  write_page(file, c);
  std::ostringstream page;
  page << std::ifstream(file).rdbuf();
  std::filesystem::remove(file);
  // A minute may pass meanwhile.
  bool says = false;
  for (const std::time_t now : {before, before + 60})
    says = says || page.str().find(fmt::format("{:%Y-%m-%d %H:%M UTC}", fmt::gmtime(now))) != std::string::npos;
  EXPECT_TRUE(says);
}

}  // namespace
}  // namespace flexspline::closed_loop::closed_loop_page_test
