// What the targets for files have in common: a folder that goes with the process, and how a target says what is wrong.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

namespace flexspline::tests {

// What is left undone ends the target; libFuzzer keeps the input.
inline void require(bool holds, const std::string& what) {
  if (holds) return;
  std::fprintf(stderr, "%s: %s\n", program_invocation_short_name, what.c_str());
  std::abort();
}

// How a model begins; further effects may follow.
inline const std::string kBeginningOfModel = R"(format = "flexspline-model/1"
[drive]
gear_ratio = 100
torque_constant_nm_a = 0.05
rated_current_a = 2
rated_velocity_rad_s = 200
rated_torque_nm = 40
[[effect]]
type = "inertia"
parameters.inertia = 1e-4
[[effect]]
type = "viscous_friction"
parameters.coefficient = 3.6e-4
)";

// In memory, where the system has such a place: targets write thousands of files a second.
class ScratchFolder {
 public:
  ScratchFolder() {
    const std::filesystem::path memory = "/dev/shm";
    const auto place = std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
    std::string name = (place / "flexspline-fuzz-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no folder can be made at " + name);
    path_ = name;
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream out(file, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    require(static_cast<bool>(out.flush()), "the scratch folder is full");
    return file;
  }

 private:
  std::filesystem::path path_;
};

}  // namespace flexspline::tests
