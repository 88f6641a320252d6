#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <vector>

#include "host/drive_link/transport/link.hpp"

extern char** environ;

namespace flexspline::transport {
namespace {

namespace fs = std::filesystem;

// Where the twin's flash memory is kept, so that what is flashed is there the next time.
fs::path flash_file(const std::string& name) {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder = state != nullptr && *state != '\0' ? fs::path(state)
                    : home != nullptr                  ? fs::path(home) / ".local" / "state"
                                                       : fs::temp_directory_path();
  folder /= "flexspline";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw LinkError(fmt::format("twin: {} could not be created: {}", folder.string(), error.message()));
  return folder / name;
}

class Twin : public Link {
 public:
  explicit Twin(bool three_phase) : name_(three_phase ? kThreePhaseTwin : "twin") {
    std::error_code error;
    const fs::path self = fs::read_symlink("/proc/self/exe", error);
    const std::string program = (self.parent_path() / "flexspline-hil").string();
    if (error || access(program.c_str(), X_OK) != 0)
      throw LinkError(fmt::format(
          "twin: {} is not there; build it with ./dev build, and keep both programs in one folder", program));
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
      throw LinkError(fmt::format("twin: no socket: {}", std::strerror(errno)));
    std::string flash = flash_file(three_phase ? "twin-three-phase.flash" : "twin.flash").string();
    std::vector<std::string> words{program, "twin", "--inherit", "--flash", flash};
    if (three_phase) words.insert(words.end(), {"--motor", "three-phase", "--motor-seed", "1", "--fast"});
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    // A group of its own: Ctrl-C is for the tool, which brings the drive to rest.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    const int failed = posix_spawn(&child_, program.c_str(), &actions, &attributes, argv.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (failed != 0) {
      close(ends[0]);
      throw LinkError(fmt::format("twin: cannot start {}: {}", program, std::strerror(failed)));
    }
    stream_ = stream_link(ends[0], name_);
  }
  ~Twin() override {
    stream_.reset();  // the twin ends with its line
    while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  Twin(const Twin&) = delete;
  Twin& operator=(const Twin&) = delete;

  void send(const protocol::Message& m) override { stream_->send(m); }
  std::optional<protocol::Message> receive(Milliseconds limit) override { return stream_->receive(limit); }
  std::string name() const override { return name_; }

 private:
  std::string name_;
  pid_t child_ = 0;
  std::unique_ptr<Link> stream_;
};

}  // namespace

std::unique_ptr<Link> open_twin(bool three_phase) {
  return std::make_unique<Twin>(three_phase);
}

}  // namespace flexspline::transport
