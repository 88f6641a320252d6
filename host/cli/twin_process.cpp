#include "host/cli/twin_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

extern char** environ;

namespace flexspline::cli {
namespace {

std::filesystem::path beside_this_program() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) throw std::runtime_error("cannot tell where this program stands: " + error.message());
  return self.parent_path() / "flexspline-hil";
}

std::string program_there() {
  const std::string program = beside_this_program().string();
  if (access(program.c_str(), X_OK) != 0)
    throw std::runtime_error(
        fmt::format("{} is not there; build it with ./dev build, and keep both programs in one folder", program));
  return program;
}

// The words of a command line; what is pointed at is `words`.
std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  return argv;
}

}  // namespace

void run_twin(const std::vector<std::string>& arguments) {
  const std::string program = program_there();
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const std::vector<char*> argv = pointers(words);
  // Standard output may belong to a machine (`--json -`).
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  const int failed = posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw std::runtime_error(fmt::format("cannot start {}: {}", program, std::strerror(failed)));
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw std::runtime_error(fmt::format("lost {}: {}", program, std::strerror(errno)));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error(fmt::format("{} {} did not succeed; its message stands above", program,
                                         arguments.empty() ? "" : arguments.front()));
}

void become_twin(const std::vector<std::string>& arguments) {
  const std::string program = program_there();
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const std::vector<char*> argv = pointers(words);
  std::fflush(nullptr);
  execv(program.c_str(), argv.data());
  throw std::runtime_error(fmt::format("cannot start {}: {}", program, std::strerror(errno)));
}

}  // namespace flexspline::cli
