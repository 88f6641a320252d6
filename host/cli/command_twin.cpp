// A drive without hardware, for the commands that speak with one.
#include <fmt/format.h>

#include "host/cli/drive_commands.hpp"
#include "host/cli/twin_process.hpp"

namespace flexspline::cli {

int run(const TwinOptions& options, Console&) {
  std::vector<std::string> words{"twin", "--serial", options.serial};
  const auto give = [&](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  give("--plant", options.plant.string());
  give("--flash", options.flash.string());
  give("--cable", options.cable.string());
  give("--json", options.json);
  if (options.usbip >= 0) give("--usbip", std::to_string(options.usbip));
  if (options.usbip < 0) give("--serve", std::to_string(options.serve));
  if (options.seconds > 0.0) give("--seconds", fmt::format("{}", options.seconds));
  if (options.fast) words.emplace_back("--fast");
  become_twin(words);
}

}  // namespace flexspline::cli
