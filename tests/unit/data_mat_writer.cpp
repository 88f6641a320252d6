#include "tests/unit/data_mat_writer.hpp"

#include <matio.h>

#include <memory>
#include <stdexcept>

namespace flexspline::data {
namespace {

struct CloseFile {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};
using Variable = std::unique_ptr<matvar_t, FreeVariable>;

Variable array(const MatVariable& v, const std::string& name) {
  std::vector<std::size_t> dims = v.dims;
  std::vector<double> values = v.values;
  return Variable(Mat_VarCreate(name.c_str(), MAT_C_DOUBLE, MAT_T_DOUBLE, static_cast<int>(dims.size()), dims.data(),
                                values.data(), 0));
}

}  // namespace

void write_mat(const std::filesystem::path& path, MatFormat format, const std::vector<MatVariable>& variables) {
  const bool hdf5 = format == MatFormat::v7_3 || format == MatFormat::v7_3_packed;
  const bool packed = format == MatFormat::v5_packed || format == MatFormat::v7_3_packed;
  const std::unique_ptr<mat_t, CloseFile> file(Mat_CreateVer(path.c_str(), nullptr, hdf5 ? MAT_FT_MAT73 : MAT_FT_MAT5));
  if (!file) throw std::runtime_error("matio cannot create " + path.string());
  for (std::size_t i = 0; i < variables.size();) {
    const std::size_t dot = variables[i].name.find('.');
    Variable variable;
    if (dot == std::string::npos) {
      variable = array(variables[i], variables[i].name);
      ++i;
    } else {
      const std::string prefix = variables[i].name.substr(0, dot + 1);
      std::size_t dims[2] = {1, 1};
      variable.reset(Mat_VarCreateStruct(prefix.substr(0, dot).c_str(), 2, dims, nullptr, 0));
      for (; i < variables.size() && variables[i].name.starts_with(prefix); ++i) {
        const std::string field = variables[i].name.substr(dot + 1);
        Mat_VarAddStructField(variable.get(), field.c_str());
        Mat_VarSetStructFieldByName(variable.get(), field.c_str(), 0, array(variables[i], field).release());
      }
    }
    if (!variable ||
        Mat_VarWrite(file.get(), variable.get(), packed ? MAT_COMPRESSION_ZLIB : MAT_COMPRESSION_NONE) != 0)
      throw std::runtime_error("matio cannot write " + path.string());
  }
}

}  // namespace flexspline::data
