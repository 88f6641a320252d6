// Of what format a file is, by its first bytes: names and endings are the user's.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace flexspline::data {

enum class FileFormat : std::uint8_t {
  text,  // CSV, plain or compressed; also whatever is not known here
  mat4,
  mat5,
  mat7_3,
  hdf5,
  npy,
  npz,
  ros1_bag,
  ros2_bag,
  mcap,
  mjlib_log,
  foreign,  // known, but not read: see `way_out`
};

FileFormat format_of(const std::filesystem::path& path);

// For a file of a format that is known but not read: its format, and the command that converts it.
struct FormatAdvice {
  std::string what;
  std::string remedy;
};
FormatAdvice way_out(const std::filesystem::path& path);

}  // namespace flexspline::data
