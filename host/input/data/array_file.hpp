// Files with named arrays as recordings: MAT of versions 5 (compressed or not, as MATLAB's -v6 and -v7 write) and 7.3,
// HDF5, NumPy's .npy and .npz.
#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/input/data/file_contents.hpp"
#include "host/input/data/file_format.hpp"
#include "host/input/data/findings.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::data {

// Columns go by what MATLAB calls them: a vector by its name, "iq"; a field as "log.iq", of a struct array
// "log(2).iq"; a matrix gives the columns "data(:,1)", "data(:,2)" ..., or the rows "data(1,:)" ... if it has more
// columns than rows. Other formats count from zero, "data[0]". Single numbers and texts are keys.
class ArrayFile final : public Recording {
 public:
  // Throws DataError (with what `findings` holds) of kind "file", "format" or "header".
  ArrayFile(const std::filesystem::path& path, FileFormat format, Findings& findings);

  const std::vector<std::string>& names() const override { return names_; }
  const std::vector<HeaderKey>& keys() const override { return keys_; }
  std::size_t length(std::size_t name) const override { return views_[name].count; }
  std::string why_not(std::string_view name) const override;
  std::string unit(std::size_t name) const override;
  Table read(std::span<const std::size_t> wanted) const override;

 private:
  struct View {  // values of one column in an array of contents_
    std::size_t array = 0;
    std::size_t first = 0;
    std::size_t step = 1;
    std::size_t count = 0;
  };

  void name_by_labels();
  void take(std::size_t array);
  void take_matrix(std::size_t array, std::size_t rows, std::size_t columns);
  void add(std::string name, const View& view);
  void take_key(const std::string& name, const std::string& value, const char* what);

  FileContents contents_;
  std::vector<std::string> names_;
  std::vector<View> views_;  // as names_
  std::vector<HeaderKey> keys_;
  std::map<std::string, std::string, std::less<>> units_;  // by name, where the file states one
  std::map<std::string, std::string, std::less<>> why_not_;
};

}  // namespace flexspline::data
