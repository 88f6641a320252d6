// A twin in its own process, as a drive that a test uses.
#pragma once

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

extern char** environ;

namespace flexspline::cli_test {

class TwinProcess {
 public:
  explicit TwinProcess(std::vector<std::string> arguments) {
    const std::string program = (std::filesystem::path(FLEXSPLINE_TOOL).parent_path() / "flexspline-hil").string();
    arguments.insert(arguments.begin(), {program, "twin"});
    std::vector<char*> argv;
    for (std::string& word : arguments) argv.push_back(word.data());
    argv.push_back(nullptr);
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    const int failed = posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    if (failed != 0) throw std::runtime_error("cannot start " + program);
    // "drive SERIAL at NAME"
    std::string line;
    for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';) line += c;
    close(ends[0]);
    const std::size_t at = line.find(" at ");
    if (at == std::string::npos) throw std::runtime_error("the twin did not start: " + line);
    name_ = line.substr(at + 4);
  }
  TwinProcess(const TwinProcess&) = delete;
  TwinProcess& operator=(const TwinProcess&) = delete;
  ~TwinProcess() { cut_power(); }

  // As --drive takes it.
  const std::string& name() const { return name_; }
  pid_t pid() const { return pid_; }
  void cut_power() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  pid_t pid_ = 0;
  std::string name_;
};

}  // namespace flexspline::cli_test
