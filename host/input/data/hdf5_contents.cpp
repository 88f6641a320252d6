// The one file that knows libhdf5.
#include "host/input/data/hdf5_contents.hpp"

#include <fmt/format.h>
#include <hdf5.h>

#include <algorithm>
#include <cstdint>

#include "host/input/data/row_major_columns.hpp"

namespace flexspline::data {
namespace {

constexpr int kDeepestGroup = 16;
constexpr std::size_t kMostObjects = 4096;

// An identifier of the library, closed by its own function.
class Id {
 public:
  Id(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  Id(const Id&) = delete;
  Id& operator=(const Id&) = delete;
  ~Id() {
    if (id_ >= 0) close_(id_);
  }
  operator hid_t() const { return id_; }
  bool is_open() const { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

std::string text_attribute(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return {};
  const Id attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const Id type(H5Aget_type(attribute), H5Tclose);
  if (!type.is_open() || H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) return {};
  // Padded by zeros or ended by one: as a text of its length it is the same.
  std::string text(H5Tget_size(type), '\0');
  if (H5Aread(attribute, type, text.data()) < 0) return {};
  return text.substr(0, std::min(text.find('\0'), text.find_last_not_of(' ') + 1));
}

class Hdf5Walk {
 public:
  Hdf5Walk(FileContents& contents, bool matlab) : contents_(contents), matlab_(matlab) {}

  void group(hid_t group, const std::string& prefix, int depth) {
    H5G_info_t info{};
    if (H5Gget_info(group, &info) < 0) return;
    for (hsize_t i = 0; i < info.nlinks; ++i) {
      if (objects_++ == kMostObjects)
        contents_.losses.push_back(fmt::format("what follows the first {} objects is left out", kMostObjects));
      if (objects_ > kMostObjects) return;
      const ssize_t length = H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, i, nullptr, 0, H5P_DEFAULT);
      if (length <= 0) continue;
      std::string name(static_cast<std::size_t>(length), '\0');
      H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size() + 1, H5P_DEFAULT);
      if (name.starts_with("#")) continue;  // MATLAB's own
      const Id object(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose);
      if (!object.is_open()) continue;
      const std::string whole = prefix.empty() ? name : prefix + (matlab_ ? "." : "/") + name;
      const H5I_type_t kind = H5Iget_type(object);
      if (kind == H5I_GROUP && depth < kDeepestGroup) this->group(object, whole, depth + 1);
      if (kind == H5I_DATASET) dataset(object, whole);
    }
  }

 private:
  void refuse(const std::string& name, std::string why) { contents_.refused.push_back({name, std::move(why)}); }

  void dataset(hid_t dataset, const std::string& name) {
    const Id space(H5Dget_space(dataset), H5Sclose);
    const Id type(H5Dget_type(dataset), H5Tclose);
    const hssize_t count = H5Sget_simple_extent_npoints(space);
    const int rank = H5Sget_simple_extent_ndims(space);
    std::vector<hsize_t> extent(static_cast<std::size_t>(std::max(rank, 0)));
    if (!space.is_open() || !type.is_open() || count < 0 ||
        H5Sget_simple_extent_dims(space, extent.data(), nullptr) < 0)
      return refuse(name, "is damaged");
    if (count == 0 || H5Aexists(dataset, "MATLAB_empty") > 0) return refuse(name, "is empty");
    const std::vector<std::size_t> dims(extent.begin(), extent.end());
    switch (H5Tget_class(type)) {
      case H5T_INTEGER:
      case H5T_FLOAT:
        return numbers(dataset, name, dims, static_cast<std::size_t>(count));
      case H5T_COMPOUND:
        return fields(dataset, type, name, static_cast<std::size_t>(count));
      case H5T_STRING:
        return refuse(name, "is text");
      case H5T_REFERENCE:
        return refuse(name, matlab_ ? "is a cell array or struct array" : "holds references");
      default:
        return refuse(name, "holds no numbers");
    }
  }

  void numbers(hid_t dataset, const std::string& name, std::vector<std::size_t> dims, std::size_t count) {
    std::vector<double> values(count);
    if (H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
      return refuse(name, "cannot be read: it is damaged, or compressed by a filter that is not here");
    if (!matlab_) return add_row_major_columns(contents_, name, dims, values);
    if (text_attribute(dataset, "MATLAB_class") == "char") {
      std::string text;
      for (const double unit : values) text += unit > 0.0 && unit < 128.0 ? static_cast<char>(unit) : '?';
      contents_.texts.push_back({name, text});
      return;
    }
    // What is stored by rows there is by columns here, with the dimensions the other way round.
    std::reverse(dims.begin(), dims.end());
    contents_.arrays.push_back({name, std::move(dims), std::move(values)});
  }

  // Each field of entries such as PyTables writes them.
  void fields(hid_t dataset, hid_t type, const std::string& name, std::size_t count) {
    const int members = H5Tget_nmembers(type);
    for (int m = 0; m < members; ++m) {
      const H5T_class_t kind = H5Tget_member_class(type, static_cast<unsigned>(m));
      char* const member = H5Tget_member_name(type, static_cast<unsigned>(m));
      if (member == nullptr) continue;
      const std::string field = member;
      if (kind == H5T_INTEGER || kind == H5T_FLOAT) {
        const Id one(H5Tcreate(H5T_COMPOUND, sizeof(double)), H5Tclose);
        H5Tinsert(one, member, 0, H5T_NATIVE_DOUBLE);
        std::vector<double> values(count);
        if (H5Dread(dataset, one, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
          refuse(name + "/" + field, "cannot be read");
        else
          contents_.arrays.push_back({name + "/" + field, {count}, std::move(values)});
      }
      H5free_memory(member);
    }
  }

  FileContents& contents_;
  bool matlab_;
  std::size_t objects_ = 0;
};

}  // namespace

FileContents read_hdf5_unguarded(const std::filesystem::path& path, bool matlab) {
  FileContents contents;
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // what is wrong is reported here
  const Id file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
  if (!file.is_open()) {
    contents.failure = "is damaged or cut short: it cannot be opened";
    return contents;
  }
  const Id root(H5Gopen2(file, "/", H5P_DEFAULT), H5Gclose);
  Hdf5Walk(contents, matlab).group(root, "", 0);
  if (contents.arrays.empty() && contents.refused.empty())
    contents.failure = "holds no data that can be read: it is empty, damaged or cut short";
  return contents;
}

}  // namespace flexspline::data
