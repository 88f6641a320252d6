#include "host/app/cli/twin_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "host/common/text/shortened.hpp"

extern char** environ;

namespace flexspline::cli {
namespace {

std::filesystem::path in_folder_of_this_program() {
  std::error_code error;
  const std::filesystem::path self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) throw std::runtime_error("could not find the folder of this program: " + error.message());
  return self.parent_path() / "flexspline-hil";
}

std::string program_there() {
  const std::string program = in_folder_of_this_program().string();
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

std::string read_to_end(int file) {
  std::string text;
  char block[4096];
  while (true) {
    const ssize_t got = read(file, block, sizeof block);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return text;
    text.append(block, static_cast<std::size_t>(got));
  }
}

// Its own message is the reason, wherever this one is shown: on a terminal, or on a page that has none.
std::string why_it_failed(const std::vector<std::string>& arguments, std::string printed, int status) {
  while (!printed.empty() && (printed.back() == '\n' || printed.back() == ' ')) printed.pop_back();
  if (!printed.empty()) return text::shortened(printed, 2000);
  const std::string how = WIFSIGNALED(status) ? fmt::format("was ended by signal {}", WTERMSIG(status))
                                              : fmt::format("ended with exit code {}", WEXITSTATUS(status));
  return fmt::format("flexspline-hil {} {} and printed nothing", arguments.empty() ? "" : arguments.front(), how);
}

}  // namespace

void run_twin(const std::vector<std::string>& arguments) {
  const std::string program = program_there();
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  const std::vector<char*> argv = pointers(words);
  int ends[2] = {-1, -1};
  if (pipe2(ends, O_CLOEXEC) != 0)
    throw std::runtime_error(fmt::format("cannot start {}: {}", program, std::strerror(errno)));
  // Standard output may belong to a machine (`--json -`).
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  pid_t child = 0;
  const int failed = posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  const std::string printed = failed == 0 ? read_to_end(ends[0]) : std::string();
  close(ends[0]);
  if (failed != 0) throw std::runtime_error(fmt::format("cannot start {}: {}", program, std::strerror(failed)));
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw std::runtime_error(fmt::format("lost {}: {}", program, std::strerror(errno)));
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error(why_it_failed(arguments, printed, status));
  // What it warned of.
  fmt::print(stderr, "{}", printed);
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
