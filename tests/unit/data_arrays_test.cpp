// host/input/data: HDF5 and NumPy files, MAT files of other programs, struct arrays, and formats that are only named.
#include <gtest/gtest.h>

#include "host/input/data/recording.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_arrays_test {
namespace {

namespace fs = std::filesystem;

const fs::path kArrays = fs::path(FLEXSPLINE_SOURCE_DIR) / "tests/unit/fixtures";

// As the fixtures were made: t = k ms, sin(60 t), 64 samples.
void expect_sine(const std::vector<double>& time, const std::vector<double>& current) {
  ASSERT_EQ(time.size(), 64u);
  for (std::size_t k = 0; k < 64; ++k) {
    ASSERT_NEAR(time[k], 0.001 * static_cast<double>(k), 1e-12);
    ASSERT_NEAR(current[k], std::sin(0.06 * static_cast<double>(k)), 1e-7);
  }
}

Table columns(const fs::path& path, const std::vector<std::string>& wanted) {
  Findings findings;
  const auto recording = open_recording(path, findings);
  std::vector<std::size_t> indices;
  for (const std::string& name : wanted) {
    const auto at = std::find(recording->names().begin(), recording->names().end(), name);
    EXPECT_NE(at, recording->names().end()) << name;
    if (at == recording->names().end()) return {};
    indices.push_back(static_cast<std::size_t>(at - recording->names().begin()));
  }
  return recording->read(indices);
}

TEST(ArrayFiles, AMatFileThatPythonWroteIsReadThoughItsClassIsPaddedByZeros) {
  const Dataset data = load({kArrays / "h5py_matlab.mat"});
  expect_sine(data.experiments[0].time_s, data.experiments[0][Column::current]);
  EXPECT_TRUE(data.experiments[0].has(Column::motor_position));
}

TEST(ArrayFiles, Hdf5GoesByPathColumnAndField) {
  const Table table =
      columns(kArrays / "h5py_plain.h5", {"log/t", "log/iq", "log/q[0]", "log/q[1]", "table/t", "table/iq"});
  ASSERT_EQ(table.columns.size(), 6u);
  expect_sine(table.columns[0], table.columns[1]);
  expect_sine(table.columns[4], table.columns[5]);
  EXPECT_DOUBLE_EQ(table.columns[3][20], 2.0 * table.columns[2][20]);
}

TEST(ArrayFiles, NumpyGoesByNameColumnAndFieldWhateverTheOrderOfBytes) {
  const Table table = columns(kArrays / "numpy_packed.npz", {"t", "iq", "big", "q[0]", "q[1]"});
  ASSERT_EQ(table.columns.size(), 5u);
  expect_sine(table.columns[0], table.columns[1]);
  expect_sine(table.columns[0], table.columns[2]);
  EXPECT_DOUBLE_EQ(table.columns[4][20], 2.0 * table.columns[3][20]);
  const Table fields = columns(kArrays / "numpy_fields.npy", {"array.time_s", "array.current_a"});
  ASSERT_EQ(fields.columns.size(), 2u);
  expect_sine(fields.columns[0], fields.columns[1]);
}

// A record array as numpy.save writes it: entries of so many bytes, after a header with this description.
std::string record_array(const std::string& descr, const std::string& entries, std::size_t count) {
  std::string header = fmt::format("{{'descr': {}, 'fortran_order': False, 'shape': ({},), }}", descr, count);
  header.resize((header.size() + 10 + 64) / 64 * 64 - 10, ' ');
  header.back() = '\n';
  const auto size = static_cast<std::uint16_t>(header.size());
  std::string text("\x93NUMPY\x01\x00", 8);
  text += static_cast<char>(size & 0xFFU);
  text += static_cast<char>(size >> 8U);
  return text + header + entries;
}

TEST(ArrayFiles, FieldsOfNumpyAfterADateAreReadAndFieldsOfSeveralNumbersRefused) {
  constexpr std::size_t kCount = 64;
  std::string dated, vectors;
  const auto put = [](std::string& text, const auto& value) {
    text.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  for (std::size_t k = 0; k < kCount; ++k) {
    put(dated, static_cast<std::int64_t>(1000000 * k));
    put(dated, std::sin(0.06 * static_cast<double>(k)));
    for (int n = 0; n < 4; ++n) put(vectors, 0.001 * static_cast<double>(k));
  }
  const TestFolder folder;
  const auto file =
      folder.write("dated.npy", record_array("[('time_s', '<M8[ns]'), ('current_a', '<f8')]", dated, kCount));
  const Table table = columns(file, {"array.time_s", "array.current_a"});
  ASSERT_EQ(table.columns.size(), 2u);
  expect_sine(table.columns[0], table.columns[1]);
  const std::vector<Finding> errors = errors_of(
      {folder.write("vectors.npy", record_array("[('time_s', '<f8'), ('tau', '<f8', (3,))]", vectors, kCount))});
  ASSERT_FALSE(errors.empty());
  EXPECT_NE(errors[0].what.find("no single numbers"), std::string::npos) << errors[0].what;
  // A header that describes a part of each entry alone.
  EXPECT_FALSE(errors_of({folder.write("short.npy", record_array("[('time_s', '<f8')]", vectors, kCount))}).empty());
}

TEST(ArrayFiles, DamagedOnesEndInAMessage) {
  const TestFolder folder;
  for (const char* name : {"h5py_plain.h5", "h5py_matlab.mat", "numpy_packed.npz", "numpy_fields.npy"}) {
    std::string whole(fs::file_size(kArrays / name), '\0');
    std::ifstream(kArrays / name, std::ios::binary).read(whole.data(), static_cast<std::streamsize>(whole.size()));
    for (std::size_t length = 9; length < whole.size(); length += 1 + whole.size() / 12) {
      const auto path = folder.write(std::string("cut-") + name, whole.substr(0, length));
      EXPECT_FALSE(errors_of({path}).empty()) << name << " " << length;
    }
  }
}

TEST(ArrayFiles, FormatsWithoutALibraryNameTheLineThatConvertsThem) {
  const TestFolder folder;
  const std::vector<Finding> errors = errors_of({folder.write("run.parquet", "PAR1" + std::string(100, 'x'))});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].text().find("Parquet"), std::string::npos);
  EXPECT_NE(errors[0].text().find("run.csv"), std::string::npos) << errors[0].text();
  const std::vector<Finding> of_json =
      errors_of({folder.write("run.jsonl", "{\"t\": 0, \"q\": 1}\n{\"t\": 1, \"q\": 2}\n")});
  ASSERT_EQ(of_json.size(), 1u);
  EXPECT_NE(of_json[0].text().find("lines=True"), std::string::npos) << of_json[0].text();
}

TEST(ArrayFiles, NamesOfElementsOfAStructArray) {
  EXPECT_EQ(without_element("log(2).iq").name, "log.iq");
  EXPECT_EQ(without_element("log(12).iq").element, 12u);
  EXPECT_EQ(without_element("data(:,1)").element, 0u);
  const std::vector<std::string> names = {"log(1).iq", "log(2).iq", "t"};
  EXPECT_EQ(name_of_element(names, "log.iq", 2), "log(2).iq");
  EXPECT_EQ(name_of_element(names, "t", 2), "t");
}

TEST(ArrayFiles, AMissingTimeIsNotReportedAsAMissingCurrent) {
  const TestFolder folder;
  folder.write("run.csv", "iq,pos\n1,2\n");
  const auto toml = folder.write("dataset.toml",
                                 "format = \"flexspline-dataset/1\"\n[columns.current_a]\nsource = \"iq\"\n"
                                 "[[experiment]]\nfile = \"run.csv\"\n");
  const std::vector<Finding> errors = errors_of({toml});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].column, "time_s");
}

}  // namespace
}  // namespace flexspline::data::data_arrays_test
