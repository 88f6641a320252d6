// What a MAT file holds, as plain values: structs are flattened to names such as "log.motor.iq".
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace flexspline::data {

struct MatArray {  // real numbers of any class, as double; column-major
  std::string name;
  std::vector<std::size_t> dims;
  std::vector<double> values;
};

struct MatText {
  std::string name;
  std::string text;
};

struct MatRefused {  // no column can be made of it
  std::string name;
  std::string why;  // "is complex": continues a sentence that begins with the name
};

struct MatContents {
  std::vector<MatArray> arrays;
  std::vector<MatText> texts;
  std::vector<MatRefused> refused;
  std::string failure;  // "is cut short": ends a sentence that begins with the file; empty: it was read to its end
};

// Reads a file of version 5 or 7.3 with matio in this process. Damaged files may crash it.
MatContents read_mat_unguarded(const std::filesystem::path& path);

// The same in a process of its own, where damage_of_mat5 looks at the file first: neither matio nor HDF5 withstands
// every damaged file (of 3000 of version 7.3 with up to three bytes changed, 5 crashed or did not end), and a crash, an
// endless loop or an absurd demand for memory there becomes a `failure` here.
MatContents read_mat(const std::filesystem::path& path);

}  // namespace flexspline::data
