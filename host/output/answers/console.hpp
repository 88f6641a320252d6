// The output of a command for a person: text on standard output, warnings and progress on standard error.
#pragma once

#include <string>
#include <string_view>

namespace flexspline::output {

// Colour and progress appear on a terminal only; NO_COLOR (see no-color.org) and TERM=dumb are respected.
class Console {
 public:
  // `quiet`: standard output belongs to a machine (`--json -`), so nothing is printed there.
  Console(std::string command, bool quiet);
  Console(const Console&) = delete;
  Console& operator=(const Console&) = delete;
  ~Console();

  // A line, or several, on standard output. Text may be empty.
  void line(std::string_view text = {});
  // "flexspline COMMAND: warning: TEXT" on standard error.
  void warn(std::string_view text);
  // "flexspline COMMAND: TEXT" on standard error.
  void error(std::string_view text);
  // What is being done, until the next message takes its place.
  void progress(std::string_view stage);

  std::string bold(std::string_view text) const { return styled(text, "1"); }
  std::string good(std::string_view text) const { return styled(text, "32"); }
  std::string bad(std::string_view text) const { return styled(text, "31"); }
  std::string dim(std::string_view text) const { return styled(text, "2"); }

 private:
  std::string styled(std::string_view text, std::string_view code) const;
  void clear_progress();

  std::string command_;
  bool quiet_;
  bool colour_;
  bool shows_progress_;
  bool progress_open_ = false;
};

// Why not all output was written to standard output (a full disk, a closed file); empty where it did. To be
// asked once, at the end: until then part of it is in memory.
std::string unwritten();

}  // namespace flexspline::output
