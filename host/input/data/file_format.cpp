#include "host/input/data/file_format.hpp"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <optional>
#include <string_view>

#include "host/input/data/mat5_check.hpp"
#include "host/input/data/recording.hpp"

namespace flexspline::data {
namespace {

using namespace std::string_view_literals;

std::string first_bytes(const std::filesystem::path& path, std::size_t count) {
  std::ifstream file(path, std::ios::binary);
  std::string head(count, '\0');
  file.read(head.data(), static_cast<std::streamsize>(count));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head;
}

struct Signature {
  std::string_view bytes;
  FileFormat format;
};
constexpr auto kSignatures = std::to_array<Signature>({
    {"\x89HDF\r\n\x1A\n"sv, FileFormat::hdf5},
    {"\x93NUMPY"sv, FileFormat::npy},
    {"PK\x03\x04"sv, FileFormat::npz},
    {"#ROSBAG V2.0"sv, FileFormat::ros1_bag},
    {"SQLite format 3\0"sv, FileFormat::ros2_bag},
    {"\x89MCAP0\r\n"sv, FileFormat::mcap},
    {"TLOG0003"sv, FileFormat::mjlib_log},
});

struct Foreign {
  std::string_view bytes;
  std::string_view what;
  std::string_view remedy;  // {0}: the file, {1}: its name without ending
};
constexpr auto kForeign = std::to_array<Foreign>({
    {"PAR1"sv, "a Parquet file",
     "run python3 -c \"import pandas; pandas.read_parquet('{0}').to_csv('{1}.csv', index=False)\""},
    {"ARROW1"sv, "an Arrow (Feather) file",
     "run python3 -c \"import pandas; pandas.read_feather('{0}').to_csv('{1}.csv', index=False)\""},
    {"MDF     "sv, "an MDF file", "run python3 -c \"import asammdf; asammdf.MDF('{0}').export('mat', '{1}.mat')\""},
    {"TDSm"sv, "a TDMS file of LabVIEW",
     "run python3 -c \"import nptdms; nptdms.TdmsFile('{0}').as_dataframe().to_csv('{1}.csv', index=False)\""},
    {"\x28\xB5\x2F\xFD"sv, "a file compressed by zstd", "run zstd -d {0}"},
    {"BZh"sv, "a file compressed by bzip2", "run bunzip2 {0}"},
    {"\xFD"
     "7zXZ"sv,
     "a file compressed by xz", "run unxz {0}"},
    {"\xD0\xCF\x11\xE0"sv, "a workbook of Excel", "save its sheet as CSV"},
    {"{\""sv, "a file of JSON lines",
     "run python3 -c \"import pandas; pandas.read_json('{0}', lines=True).to_csv('{1}.csv', index=False)\""},
    {"[{\""sv, "a file of JSON",
     "run python3 -c \"import pandas; pandas.read_json('{0}').to_csv('{1}.csv', index=False)\""},
});

const Foreign* foreign_of(std::string_view head) {
  for (const Foreign& foreign : kForeign)
    if (head.starts_with(foreign.bytes)) return &foreign;
  return nullptr;
}

// The first file in it is what Office begins with.
bool is_office(std::string_view head) {
  return head.find("[Content_Types].xml") != std::string_view::npos ||
         head.find("mimetypeapplication") != std::string_view::npos;
}

}  // namespace

FileFormat format_of(const std::filesystem::path& path) {
  const MatVersion mat = mat_version(path);
  if (mat == MatVersion::v5) return FileFormat::mat5;
  if (mat == MatVersion::v7_3) return FileFormat::mat7_3;
  const std::string head = first_bytes(path, 128);
  for (const Signature& signature : kSignatures)
    if (head.starts_with(signature.bytes)) return is_office(head) ? FileFormat::foreign : signature.format;
  if (foreign_of(head) != nullptr) return FileFormat::foreign;
  return mat == MatVersion::v4 && lower_extension(path) == ".mat" ? FileFormat::mat4 : FileFormat::text;
}

FormatAdvice way_out(const std::filesystem::path& path) {
  const std::string head = first_bytes(path, 128);
  if (is_office(head)) return {"this is a workbook of an office program, which is not read", "save its sheet as CSV"};
  const Foreign* foreign = foreign_of(head);
  if (foreign == nullptr) return {"this file is not read", "export the measurement as CSV"};
  const std::string stem = (path.parent_path() / path.stem()).string();
  return {fmt::format("this is {}, which is not read", foreign->what),
          fmt::format(fmt::runtime(foreign->remedy), path.string(), stem)};
}

}  // namespace flexspline::data
