#include "hil/board/processor.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

extern char** environ;

namespace flexspline::board {
namespace {

constexpr const char* kEmulator = "qemu-system-arm";
constexpr int kPatienceMs = 20'000;  // of one answer; a tick takes some ten microseconds

std::string found_on_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::string folders = path == nullptr ? "" : path;
  for (std::size_t start = 0; start <= folders.size();) {
    const std::size_t end = std::min(folders.find(':', start), folders.size());
    const std::string candidate = folders.substr(start, end - start) + "/" + program;
    if (access(candidate.c_str(), X_OK) == 0) return candidate;
    start = end + 1;
  }
  return {};
}
std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

constexpr const char* kMakes = "boards/qemu_stm32f405/build.sh makes one";

// By the header: an ELF file of 32 bits for machine 40.
bool is_arm_program(const std::filesystem::path& file) {
  std::array<char, 20> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  return std::string_view(head.data(), 5) ==
             "\x7f"
             "ELF\x01" &&
         head[18] == 40 && head[19] == 0;
}

}  // namespace

bool Processor::is_installed() {
  return !found_on_path(kEmulator).empty();
}

Processor::Processor(std::filesystem::path image) : image_(std::filesystem::absolute(std::move(image))) {
  if (!std::filesystem::is_regular_file(image_))
    throw std::runtime_error(image_.string() + ": no such firmware image; " + kMakes);
  if (!is_arm_program(image_)) throw std::runtime_error(image_.string() + ": is not an ARM program (ELF); " + kMakes);
  if (!is_installed())
    throw std::runtime_error(std::string(kEmulator) + " is not installed; it is in the Debian package of that name");
  // Writing to a pipe without a reader is an error of write(), not the end of this program.
  signal(SIGPIPE, SIG_IGN);
}

Processor::~Processor() {
  end();
}

void Processor::end() {
  if (child_ > 0) {
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  if (to_image_ >= 0) close(to_image_);
  if (from_image_ >= 0) close(from_image_);
  child_ = to_image_ = from_image_ = -1;
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
  folder_.clear();
}

void Processor::start(const Block& block, const firmware::TelemetrySetup& telemetry, firmware::ResetCause) {
  end();  // after a power cut
  std::string folder = (std::filesystem::temp_directory_path() / "flexspline-processor-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error(folder + ": cannot be made: " + std::strerror(errno));
  folder_ = folder;
  const std::string to_image = folder + "/to_drive", from_image = folder + "/from_drive", log = folder + "/log";
  if (mkfifo(to_image.c_str(), 0600) != 0 || mkfifo(from_image.c_str(), 0600) != 0)
    throw std::runtime_error(folder + ": pipes cannot be made there: " + std::strerror(errno));
  // Open for both directions, so that neither end waits for the other to open.
  to_image_ = open(to_image.c_str(), O_RDWR | O_CLOEXEC);
  from_image_ = open(from_image.c_str(), O_RDWR | O_CLOEXEC);
  if (to_image_ < 0 || from_image_ < 0)
    throw std::runtime_error(folder + ": the pipes cannot be opened: " + std::strerror(errno));

  const std::string emulator = found_on_path(kEmulator), image = image_.string();
  const std::array<const char*, 16> arguments{kEmulator,
                                              "-M",
                                              "netduinoplus2",
                                              "-nographic",
                                              "-monitor",
                                              "none",
                                              "-serial",
                                              "none",
                                              "-semihosting-config",
                                              "enable=on,target=native",
                                              "-icount",
                                              "shift=0,sleep=off",
                                              "-kernel",
                                              image.c_str(),
                                              nullptr};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, 1, 2);
  const int error =
      posix_spawn(&child_, emulator.c_str(), &actions, nullptr, const_cast<char* const*>(arguments.data()), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    child_ = -1;
    throw std::runtime_error(emulator + " cannot be started: " + std::strerror(error));
  }
  const auto bytes = block.bytes();
  const firmware::CoSimulationStart start{static_cast<std::uint32_t>(bytes.size()), telemetry};
  send(&start, sizeof(start));
  send(bytes.data(), bytes.size());
}

firmware::CoSimulationOutput Processor::tick(const firmware::CoSimulationInput& input) {
  send(&input, sizeof(input));
  firmware::CoSimulationOutput output;
  receive(&output, sizeof(output));
  most_instructions_ = std::max(most_instructions_, output.instructions);
  instructions_ += output.instructions;
  ++ticks_;
  return output;
}

void Processor::offer(std::span<const std::byte>) {
  throw std::logic_error("the processor takes its block when it starts");
}

int Processor::stop() {
  if (child_ <= 0) return 0;
  firmware::CoSimulationInput last;
  last.ends = true;
  send(&last, sizeof(last));
  firmware::CoSimulationOutput output;
  receive(&output, sizeof(output));
  stack_bytes_ = output.stack_bytes;
  int status = 0;
  waitpid(child_, &status, 0);
  child_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void Processor::send(const void* bytes, std::size_t count) {
  const char* from = static_cast<const char*>(bytes);
  while (count > 0) {
    pollfd ready{to_image_, POLLOUT, 0};
    if (poll(&ready, 1, kPatienceMs) != 1) fail("does not accept data any more");
    const ssize_t written = write(to_image_, from, std::min<std::size_t>(count, PIPE_BUF));
    if (written <= 0) fail("cannot be written to");
    from += written;
    count -= static_cast<std::size_t>(written);
  }
}

void Processor::receive(void* bytes, std::size_t count) {
  char* to = static_cast<char*>(bytes);
  while (count > 0) {
    pollfd ready{from_image_, POLLIN, 0};
    // In short intervals, so that the end of the emulator is detected.
    int waited = 0;
    while (poll(&ready, 1, 100) != 1) {
      int status = 0;
      if (waitpid(child_, &status, WNOHANG) == child_) {
        child_ = -1;
        fail("ended by itself");
      }
      waited += 100;
      if (waited >= kPatienceMs) fail("does not answer");
    }
    const ssize_t got = read(from_image_, to, count);
    if (got <= 0) fail("cannot be read from");
    to += got;
    count -= static_cast<std::size_t>(got);
  }
}

void Processor::fail(const char* what) {
  const std::string said = text_of(folder_ / "log");
  // When a processor stops at a fault the emulator prints all registers.
  throw std::runtime_error("the emulated processor " + std::string(what) +
                           (said.empty() ? "" : ": " + said.substr(0, said.find('\n'))) + "; is " + image_.string() +
                           " the image of boards/qemu_stm32f405?");
}

}  // namespace flexspline::board
