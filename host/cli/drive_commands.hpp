// The commands that speak with a drive: what each is given, and what runs it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/cli/inputs.hpp"
#include "host/drive/session.hpp"

namespace flexspline::cli {

struct DrivesOptions {
  std::vector<std::string> also;  // ports and sockets to search
  std::string json;
};
int run(const DrivesOptions& options, Console& console);

struct FlashOptions {
  std::string drive;
  std::filesystem::path model;
  std::filesystem::path block;
  std::filesystem::path settings;  // empty: those of the active block
  std::filesystem::path firmware;
  bool older = false;     // firmware
  int draws = 4;          // of the prediction; zero: none
  bool measured = false;  // as pack --measured
  bool yes = false;
  std::string json;
};
int run(const FlashOptions& options, Console& console);

struct BackupOptions {
  std::string drive;
  std::filesystem::path out;
  bool previous = false;
  std::string json;
};
int run(const BackupOptions& options, Console& console);

struct RestoreOptions {
  std::string drive;
  bool factory_reset = false;
  bool yes = false;
  std::string json;
};
int run(const RestoreOptions& options, Console& console);

struct HomeOptions {
  std::string drive;
  std::optional<double> position;  // of the motor; none: only queried
  std::string json;
};
int run(const HomeOptions& options, Console& console);

struct MonitorOptions {
  std::string drive;
  double seconds = 0.0;  // zero: until Ctrl-C
  double rate_hz = 10.0;
  std::vector<std::string> channels;
  bool residual_map = false;  // that, and not the signals
  bool reset = false;
  std::optional<double> limit_nm;
  std::string json;
};
int run(const MonitorOptions& options, Console& console);
int run_residual_map(const MonitorOptions& options, Console& console);

struct RecordOptions {
  std::string drive;
  std::filesystem::path plan;
  std::filesystem::path out;
  bool yes = false;
  bool force = false;
  bool clear_fault = false;
  bool compensate = false;
  std::vector<std::string> runs;              // of the plan, by name; none: all
  std::optional<double> full_velocity_rad_s;  // of the report's plans
  std::optional<double> full_current_a;
  std::string json;
};
int run(const RecordOptions& options, Console& console);

struct TwinOptions {
  std::filesystem::path plant;  // empty: the demo's drive
  std::filesystem::path flash;  // empty: what is flashed ends with the twin
  std::filesystem::path cable;  // unplugs it while this text is shown; empty: none
  std::string serial = "TWIN";
  int serve = 0;   // port; zero: any that is free
  int usbip = -1;  // port of a USB device; below zero: none
  double seconds = 0.0;
  bool fast = false;
  std::string json;
};
// Does not come back: the process is the twin from then on.
int run(const TwinOptions& options, Console& console);

// Opens what --drive names and identifies it.
drive::Session open_drive(const std::string& drive);
// "drive SERIAL (BOARD) at NAME".
std::string named(const drive::Session& session);
// Asks on a terminal, unless `yes`; without a terminal there is no question and the result is true.
bool confirmed(const std::string& question, bool yes);
// A good parameter block from a file. Throws UsageError where it cannot be read, deployment::PackError with the file
// and the place where the block is bad.
drive::Bytes read_block_file(const std::filesystem::path& path);

// True once Ctrl-C was pressed (or the process received SIGTERM) while one of these exists.
class Interruptible {
 public:
  Interruptible();
  ~Interruptible();
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;
  static bool interrupted();
};

}  // namespace flexspline::cli
