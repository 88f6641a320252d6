// A program that prints "port N" or "tcp:HOST:N" once it listens, and ends at SIGTERM: a twin, or what stands in for
// one.
#pragma once

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace flexspline::tests {

class PortProcess {
 public:
  PortProcess(const std::string& program, const std::vector<std::string>& arguments) {
    std::vector<std::string> words{program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    int ends[2];
    if (pipe(ends) != 0) throw std::runtime_error("no pipe");
    child_ = fork();
    if (child_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(ends[1]);
    out_ = ends[0];
    std::string line;
    for (char c = 0; read(out_, &c, 1) == 1 && c != '\n';) line += c;
    const std::size_t number = line.find_last_of(" :");
    if (!line.starts_with("port ") && !line.starts_with("tcp:")) {
      end();
      throw std::runtime_error(program + " does not start: " + line);
    }
    port_ = static_cast<std::uint16_t>(std::stoi(line.substr(number + 1)));
  }
  ~PortProcess() { end(); }
  PortProcess(const PortProcess&) = delete;
  PortProcess& operator=(const PortProcess&) = delete;
  std::uint16_t port() const { return port_; }

 private:
  void end() const {
    kill(child_, SIGTERM);
    waitpid(child_, nullptr, 0);
    close(out_);
  }
  pid_t child_ = 0;
  int out_ = -1;
  std::uint16_t port_ = 0;
};

}  // namespace flexspline::tests
