// What a file with named arrays holds, as plain values: what MAT, HDF5 and NumPy files and recordings of ROS have in
// common.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace flexspline::data {

struct NamedArray {  // real numbers of any class, as double; column-major
  std::string name;
  std::vector<std::size_t> dims;
  std::vector<double> values;
};

struct NamedText {
  std::string name;
  std::string text;
};

struct NotAColumn {  // it cannot be a column
  std::string name;
  std::string why;  // "is complex": continues a sentence that begins with the name
};

struct FileContents {
  std::vector<NamedArray> arrays;
  std::vector<NamedText> texts;
  std::vector<NotAColumn> refused;
  std::vector<std::string> losses;  // of what the columns lack: "3 messages of /joint_states are left out: ..."
  std::string failure;  // "is cut short": ends a sentence that begins with the file; empty: it was read to its end
};

}  // namespace flexspline::data
