// What a control tick of the application gets to do, recorded on the software board and read back from the image:
//   tick_inputs record FOLDER    writes FOLDER/demo/to_drive and FOLDER/demo_and_seven/to_drive: the co-simulation's
//   pipe
//                                of a drive in closed loop as a file, which an image reads as it would read the pipe
//   tick_inputs counts FILE      least, most and mean instructions of the armed ticks, from an image's answers
// As the image computes the same bits, its loop is closed although its inputs are a file.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "hil/board/drive_setup.hpp"
#include "hil/board/scenario.hpp"

namespace {

using namespace flexspline;

// All that costs instructions is on: twelve channels of telemetry at every tick, set points at every millisecond, and
// from here on the residual map.
constexpr std::uint64_t kMapFrom = 110;
// Those before arm the drive and enter its mode.
constexpr std::uint64_t kFirstCounted = 150;
constexpr double kSeconds = 0.25;

class Recorder : public board::Controller {
 public:
  explicit Recorder(const std::filesystem::path& file) : out_(file, std::ios::binary) {
    if (!out_) throw std::runtime_error(file.string() + " cannot be written");
  }
  ~Recorder() override {
    firmware::CoSimulationInput last;
    last.ends = true;
    write(last);
  }
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  void start(const board::Block& block, const firmware::TelemetrySetup& telemetry,
             firmware::ResetCause cause) override {
    const auto bytes = block.bytes();
    write(firmware::CoSimulationStart{static_cast<std::uint32_t>(bytes.size()), telemetry});
    out_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    controller_.start(block, telemetry, cause);
  }
  firmware::CoSimulationOutput tick(const firmware::CoSimulationInput& down) override {
    firmware::CoSimulationInput said = down;
    const bool starts_map = ++ticks_ >= kMapFrom && !maps_ && !down.has_command;
    if (starts_map) {
      said.command = {};
      said.command.kind = firmware::Command::Kind::start_map;
      said.has_command = maps_ = true;
    }
    write(said);
    firmware::CoSimulationOutput up = controller_.tick(said);
    if (starts_map) up.has_answer = false;  // to who did not ask
    return up;
  }
  void offer(std::span<const std::byte>) override { throw std::logic_error("a recorded drive keeps its block"); }

 private:
  template <class T>
  void write(const T& item) {
    out_.write(reinterpret_cast<const char*>(&item), sizeof(item));
  }

  board::SoftwareController controller_;
  std::ofstream out_;
  std::uint64_t ticks_ = 0;
  bool maps_ = false;
};

int record(const std::filesystem::path& folder) {
  for (const bool seven : {false, true}) {
    board::ScenarioPlan plan;
    plan.drive = plant::demo_plant().drive;
    if (seven)
      for (const char* effect : {"stribeck_gaussian", "torque_ripple:2", "torque_ripple:7", "gravity",
                                 "kinematic_error", "load_dependent_friction", "temperature_viscous"})
        plant::with(plan.drive, effect);
    plan.scenario = "joint-trajectory";
    plan.duration_s = kSeconds;
    plan.hold_s = 0.0;
    plan.seed = 7001;
    plan.start_turns = 0.0;  // as when the budget was set
    plan.compensation = true;
    const std::filesystem::path to = folder / (seven ? "demo_and_seven" : "demo");
    std::filesystem::create_directories(to);
    const auto result = board::run_scenario(plan, std::make_unique<Recorder>(to / "to_drive"));
    if (result.end.mode != firmware::Mode::position) throw std::runtime_error("the drive ended in another mode");
  }
  return 0;
}

int count(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  firmware::CoSimulationOutput up;
  std::vector<std::uint32_t> counts;
  for (std::uint64_t tick = 0; in.read(reinterpret_cast<char*>(&up), sizeof(up)); ++tick)
    if (tick >= kFirstCounted && up.status.mode == firmware::Mode::position) counts.push_back(up.instructions);
  if (counts.size() < 1000) throw std::runtime_error(file.string() + " holds too few armed ticks");
  double sum = 0.0;
  for (const std::uint32_t n : counts) sum += n;
  const auto [least, most] = std::minmax_element(counts.begin(), counts.end());
  std::printf("%u %u %.0f\n", *least, *most, sum / static_cast<double>(counts.size()));
  return 0;
}

}  // namespace

int main(int words, char** word) {
  try {
    const std::string verb = words == 3 ? word[1] : "";
    if (verb == "record") return record(word[2]);
    if (verb == "counts") return count(word[2]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "tick_inputs: %s\n", error.what());
    return 1;
  }
  std::fprintf(stderr, "usage: tick_inputs record FOLDER | counts FILE\n");
  return 2;
}
