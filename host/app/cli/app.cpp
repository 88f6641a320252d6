#include "host/app/cli/app.hpp"

#include "host/app/cli/command_line.hpp"

namespace flexspline::cli {

#define COMMAND(name) Command name##_command();
#include "host/app/cli/command_list.inc"
#undef COMMAND

std::vector<Command> all_commands() {
  return {
#define COMMAND(name) name##_command(),
#include "host/app/cli/command_list.inc"
#undef COMMAND
  };
}

int run(int argc, char** argv) {
  return run(all_commands(), argc, argv);
}

}  // namespace flexspline::cli
