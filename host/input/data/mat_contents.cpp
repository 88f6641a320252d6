// The one file that knows matio.
#include "host/input/data/mat_contents.hpp"

#include <fmt/format.h>
#include <matio.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <set>

namespace flexspline::data {
namespace {

// Deeper structs hold settings, not signals; a damaged file may nest without end.
constexpr int kDeepest = 16;
// More elements than this are data of another kind, not a handful of signals.
constexpr std::size_t kMostElements = 64;
constexpr const char* kDamaged = "is damaged";

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using File = std::unique_ptr<mat_t, CloseFile>;
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

std::vector<std::size_t> dims_of(const matvar_t& variable) {
  if (variable.dims == nullptr || variable.rank < 0) return {};
  return {variable.dims, variable.dims + variable.rank};
}

// Zero where the dimensions are absent, empty or overflow.
std::size_t count_of(const std::vector<std::size_t>& dims) {
  if (dims.empty()) return 0;
  std::size_t count = 1;
  for (const std::size_t d : dims)
    if (__builtin_mul_overflow(count, d, &count)) return 0;
  return count;
}

template <typename T>
std::vector<double> as_double(const void* data, std::size_t count) {
  const T* values = static_cast<const T*>(data);
  std::vector<double> numbers(count);
  std::transform(values, values + count, numbers.begin(), [](T value) { return static_cast<double>(value); });
  return numbers;
}

std::vector<double> numbers_of(const matvar_t& variable, std::size_t count) {
  switch (variable.data_type) {
    case MAT_T_DOUBLE:
      return as_double<double>(variable.data, count);
    case MAT_T_SINGLE:
      return as_double<float>(variable.data, count);
    case MAT_T_INT8:
      return as_double<std::int8_t>(variable.data, count);
    case MAT_T_UINT8:
      return as_double<std::uint8_t>(variable.data, count);
    case MAT_T_INT16:
      return as_double<std::int16_t>(variable.data, count);
    case MAT_T_UINT16:
      return as_double<std::uint16_t>(variable.data, count);
    case MAT_T_INT32:
      return as_double<std::int32_t>(variable.data, count);
    case MAT_T_UINT32:
      return as_double<std::uint32_t>(variable.data, count);
    case MAT_T_INT64:
      return as_double<std::int64_t>(variable.data, count);
    case MAT_T_UINT64:
      return as_double<std::uint64_t>(variable.data, count);
    default:
      return {};
  }
}

// One line of text; what is not ASCII in UTF-16 becomes a question mark, as names and keys need no more.
std::string text_of(const matvar_t& variable, std::size_t count) {
  if (variable.data == nullptr) return {};
  if (variable.data_size == 1) return {static_cast<const char*>(variable.data), std::min(count, variable.nbytes)};
  std::string text;
  if (variable.data_size == 2) {
    const auto* units = static_cast<const std::uint16_t*>(variable.data);
    for (std::size_t i = 0; i < std::min(count, variable.nbytes / 2); ++i)
      text += units[i] < 128 ? static_cast<char>(units[i]) : '?';
  }
  return text;
}

class Flattener {
 public:
  explicit Flattener(FileContents& contents) : contents_(contents) {}

  void take(const matvar_t& variable, const std::string& name, int depth = 0) {
    const std::vector<std::size_t> dims = dims_of(variable);
    const std::size_t count = count_of(dims);
    switch (variable.class_type) {
      case MAT_C_STRUCT:
        take_struct(variable, name, count, depth);
        return;
      case MAT_C_CHAR:
        contents_.texts.push_back({name, text_of(variable, count)});
        return;
      case MAT_C_CELL:
        refuse(name, "is a cell array");
        return;
      case MAT_C_SPARSE:
        refuse(name, "is sparse");
        return;
      case MAT_C_FUNCTION:
        refuse(name, "is a function");
        return;
      case MAT_C_OBJECT:
      case MAT_C_OPAQUE:
        refuse(name, "is an object (timetable, timeseries, table, Dataset), which only MATLAB can read");
        return;
      case MAT_C_EMPTY:
        refuse(name, "is empty");
        return;
      default:
        take_numbers(variable, name, dims, count);
    }
  }

 private:
  void refuse(const std::string& name, std::string why) { contents_.refused.push_back({name, std::move(why)}); }

  void take_numbers(const matvar_t& variable, const std::string& name, const std::vector<std::size_t>& dims,
                    std::size_t count) {
    if (count == 0) {
      refuse(name, "is empty");
    } else if (variable.isComplex != 0) {
      refuse(name, "is complex");
    } else if (variable.data == nullptr || variable.data_size <= 0 ||
               variable.nbytes / static_cast<std::size_t>(variable.data_size) < count ||
               static_cast<std::size_t>(variable.data_size) != Mat_SizeOf(variable.data_type)) {
      refuse(name, kDamaged);
    } else if (std::vector<double> values = numbers_of(variable, count); values.empty()) {
      refuse(name, "is of a class that is not known");
    } else {
      contents_.arrays.push_back({name, dims, std::move(values)});
    }
  }

  void take_struct(const matvar_t& variable, const std::string& name, std::size_t count, int depth) {
    const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&variable));
    char* const* const field_names = Mat_VarGetStructFieldnames(&variable);
    if (count == 0 || fields == 0 || field_names == nullptr || variable.data == nullptr)
      return refuse(name, "is an empty struct");
    if (depth >= kDeepest) return refuse(name, "is nested too deeply");
    if (count > kMostElements) return refuse(name, fmt::format("is a struct array of {} elements", count));
    if (variable.nbytes / sizeof(matvar_t*) / fields < count) return refuse(name, kDamaged);
    const auto* const values = static_cast<matvar_t* const*>(variable.data);
    for (std::size_t i = 0; i < count; ++i) {
      const std::string element = count == 1 ? name : fmt::format("{}({})", name, i + 1);
      for (unsigned f = 0; f < fields; ++f) {
        const matvar_t* value = values[i * fields + f];
        if (value != nullptr && field_names[f] != nullptr)
          take(*value, fmt::format("{}.{}", element, field_names[f]), depth + 1);
      }
    }
  }

  FileContents& contents_;
};

// MATLAB's own parts, such as what its objects refer to, have no name of a variable.
bool is_name(const char* name) {
  return name != nullptr && name[0] != '\0' && name[0] != '#';
}

}  // namespace

FileContents read_mat_unguarded(const std::filesystem::path& path) {
  FileContents contents;
  const File file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) {
    contents.failure = "is damaged or cut short: it cannot be opened";
    return contents;
  }
  Flattener flattener(contents);
  std::set<std::string> read;
  while (const Variable variable{Mat_VarReadNext(file.get())}) {
    if (!is_name(variable->name)) continue;
    flattener.take(*variable, variable->name);
    read.insert(variable->name);
  }
  // matio ends silently at a variable of a version 7.3 file that it cannot read.
  std::size_t count = 0;
  char* const* const directory = Mat_GetDir(file.get(), &count);
  for (std::size_t i = 0; directory != nullptr && i < count; ++i)
    if (is_name(directory[i]) && read.count(directory[i]) == 0) contents.refused.push_back({directory[i], kDamaged});
  // Nor does it report that HDF5 could not open one.
  if (read.empty() && contents.refused.empty())
    contents.failure = "holds no variable that can be read: it is empty, damaged or cut short";
  return contents;
}

}  // namespace flexspline::data
