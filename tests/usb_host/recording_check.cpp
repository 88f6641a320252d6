// recording_check TWIN SECONDS: the tool's recorder on a twin over HID. Six channels at 1 kHz for so many seconds of
// the drive's time, as fast as both can: nothing may be lost. Then a host that reads too slowly: what is lost is
// counted, and named in the file. TWIN is flexspline-hil. Exit code 0 where all of it holds.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "host/drive_link/drive/dataset_writer.hpp"
#include "host/drive_link/drive/recorder.hpp"
#include "tests/support/port_process.hpp"
#include "tests/support/usbip_link.hpp"

namespace {

using namespace flexspline;

int failures = 0;
void expect(bool holds, const std::string& what) {
  if (holds) return;
  ++failures;
  fmt::print("FAILED: {}\n", what);
}

// flexspline-hil twin --usbip 0, until it is gone with this.
class Twin : public tests::PortProcess {
 public:
  Twin(const char* program, const std::vector<std::string>& more) : PortProcess(program, words(more)) {}

 private:
  static std::vector<std::string> words(const std::vector<std::string>& more) {
    std::vector<std::string> all{"twin", "--usbip", "0"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};

struct Made {
  drive::Recording recording;
  std::string csv;
  double took_s = 0.0;
};
Made record(std::uint16_t port, const planning::Run& run, std::chrono::milliseconds pause) {
  drive::Session session(std::make_unique<tests::UsbIpLink>(port, pause), transport::Milliseconds(5000));
  const drive::Scales scales = drive::scales_of(session);
  planning::Plan plan;
  plan.sample_s = 1e-3;
  plan.runs = {run};
  drive::Recorder recorder(session, scales, plan);
  const auto begin = std::chrono::steady_clock::now();
  Made made{recorder.record(run, {}), {}, 0.0};
  made.took_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  made.csv = drive::csv_of(made.recording, scales, {session.serial(), session.board(), "", ""});
  return made;
}

void nothing_is_lost(const char* program, double seconds) {
  const Twin twin(program, {"--fast"});
  planning::Run run;
  run.name = "long";
  run.amplitude = 50.0;
  run.frequency_hz = 0.5;
  run.duration_s = seconds;
  const Made made = record(twin.port(), run, std::chrono::milliseconds(0));
  const drive::Recording& r = made.recording;
  fmt::print(
      "{} samples of six channels, {:.1f} s of the drive's time, {} lost, {} of them on the drive; took {:.1f} s\n",
      r.time_s.size(), r.time_s.empty() ? 0.0 : r.time_s.back(), r.lost, r.dropped, made.took_s);
  expect(r.complete, "the run is complete: " + r.ended);
  expect(r.lost == 0 && r.dropped == 0 && r.gaps.empty(), "nothing is lost");
  expect(static_cast<double>(r.time_s.size()) >= 1000.0 * seconds, "a sample each millisecond");
  std::size_t uneven = 0;
  for (std::size_t k = 1; k < r.time_s.size(); ++k) uneven += std::abs(r.time_s[k] - r.time_s[k - 1] - 1e-3) > 1e-9;
  expect(uneven == 0, fmt::format("{} steps are not a millisecond", uneven));
  expect(made.csv.find("# frames_lost: 0\n") != std::string::npos, "the file says that nothing is lost");
}

void a_slow_hosts_loss_is_counted(const char* program) {
  const Twin twin(program, {});
  planning::Run run;
  run.name = "slow";
  run.mode = planning::Mode::off;
  run.duration_s = 2.0;
  // Two frames a report: 200 a second at most, of a thousand.
  const Made made = record(twin.port(), run, std::chrono::milliseconds(10));
  const drive::Recording& r = made.recording;
  const auto spanned = static_cast<std::uint64_t>(std::llround(1000.0 * r.time_s.back())) + 1;
  fmt::print("a host that takes 100 reports a second: {} samples, {} lost, {} of them on the drive\n", r.time_s.size(),
             r.lost, r.dropped);
  expect(r.lost > 500, "most is lost");
  expect(r.time_s.size() + r.lost == spanned, "each frame of the time is there or counted as lost");
  expect(r.dropped > 0, "the drive counts what it had no room for");
  expect(made.csv.find(fmt::format("# frames_lost: {}\n", r.lost)) != std::string::npos, "the file says how many");
  expect(made.csv.find("# gap_at_") != std::string::npos, "the file says where");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "recording_check TWIN SECONDS\n");
    return 2;
  }
  try {
    nothing_is_lost(argv[1], std::atof(argv[2]));
    a_slow_hosts_loss_is_counted(argv[1]);
  } catch (const std::exception& error) {
    fmt::print("FAILED: {}\n", error.what());
    return 1;
  }
  return failures == 0 ? 0 : 1;
}
