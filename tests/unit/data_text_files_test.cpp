// host/input/data: texts as loggers of all kinds write them, and what is no text.
#include <gtest/gtest.h>
#include <zlib.h>

#include "host/input/data/csv.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_text_files_test {
namespace {

namespace fs = std::filesystem;

// Fifty lines of a time in milliseconds and a current, under the given lines.
std::string fifty(const std::string& head, const std::string& separator = ",") {
  std::string text = head;
  for (int k = 0; k < 50; ++k) text += fmt::format("{}{}{}\n", k, separator, 0.25 * k);
  return text;
}

Experiment only(const fs::path& path, const std::string& columns) {
  const fs::path toml = path.parent_path() / "dataset.toml";
  std::ofstream(toml) << "format = \"flexspline-dataset/1\"\n" << columns;
  const Dataset data = load({path});
  fs::remove(toml);
  return data.experiments.at(0);
}
constexpr const char* kMapped =
    "[columns.time_s]\nsource = \"t\"\nunit = \"ms\"\n[columns.current_a]\nsource = \"i\"\n";

void expect_fifty(const Experiment& e) {
  ASSERT_EQ(e.size(), 50u);
  EXPECT_NEAR(e.sample_s, 0.001, 1e-12);
  for (std::size_t k = 0; k < 50; ++k) ASSERT_DOUBLE_EQ(e[Column::current][k], 0.25 * static_cast<double>(k));
}

std::string errors_text(const fs::path& path) {
  std::string text;
  for (const Finding& error : errors_of({path})) text += error.kind + ": " + error.text() + "\n";
  return text;
}

TEST(TextFiles, CompressedByGzipReadTheSame) {
  const TestFolder folder;
  const fs::path path = folder.path() / "run.csv.gz";
  const std::string text = good_csv(500);
  gzFile file = gzopen(path.c_str(), "wb");
  gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
  gzclose(file);
  EXPECT_EQ(load({path}).experiments[0].columns, load({folder.write("run.csv", text)}).experiments[0].columns);
  EXPECT_EQ(load({folder.path()}).experiments.size(), 2u);  // found in a folder, too
  std::string cut(1 << 12, '\0');
  std::ifstream(path, std::ios::binary).read(cut.data(), 1 << 12);
  EXPECT_NE(errors_text(folder.write("cut.csv.gz", cut)).find("damaged or cut short"), std::string::npos);
}

TEST(TextFiles, ALineOfUnitsIsUsedAndANoteSaysSo) {
  const TestFolder folder;
  const fs::path path = folder.write("units.csv", fifty("time_s,current_a\n[ms],[mA]\n"));
  const Dataset data = load({path});
  EXPECT_NEAR(data.experiments[0].sample_s, 0.001, 1e-12);
  EXPECT_DOUBLE_EQ(data.experiments[0][Column::current][4], 0.001);
  const std::vector<Finding> notes = of_kind(data.findings, "unit");
  ASSERT_FALSE(notes.empty());
  EXPECT_EQ(notes[0].severity, Severity::note);
  EXPECT_EQ(notes[0].line, 2u);
  // What dataset.toml says wins.
  expect_fifty(only(folder.write("mapped.csv", fifty("t,i\ns,A\n")), kMapped));
  // A second line of names is none, and stays an error.
  EXPECT_NE(errors_text(folder.write("names.csv", fifty("time_s,current_a\ntime,current\n"))).find("text_in_number"),
            std::string::npos);
}

TEST(TextFiles, NamesInLatin1BecomeUtf8) {
  const TestFolder folder;
  Findings findings;
  const CsvFile file(folder.write("latin1.csv", fifty("t,Winkel [\xB0]\n")), findings);
  EXPECT_EQ(file.names()[1], "Winkel [\xC2\xB0]");
  ASSERT_EQ(findings.list().size(), 1u);
  EXPECT_NE(findings.list()[0].what.find("Latin-1"), std::string::npos);
}

TEST(TextFiles, DatesAndTimesOfDayBecomeSecondsSinceTheFirst) {
  for (const std::string day : {"2024-02-29T23:59:59.", "2024-02-29 23:59:59.", "23:59:59."}) {
    const TestFolder folder;
    std::string text = "t;i\n";
    for (int k = 0; k < 50; ++k) text += fmt::format("{}{:03}Z;{}\n", day, 900 + k, 0.25 * k);
    if (day.size() < 12) std::erase(text, 'Z');
    const Experiment e = only(folder.write("stamps.csv", text),
                              "[columns.time_s]\nsource = \"t\"\n[columns.current_a]\nsource = \"i\"\n");
    expect_fifty(e);
    EXPECT_EQ(e.time_s[0], 0.0);
  }
  // No year of a recording.
  const TestFolder far;
  EXPECT_NE(errors_text(far.write("far.csv", "time_s,current_a\n9999-01-01T00:00:00,1\n")).find("is not a number"),
            std::string::npos);
  // Over midnight.
  const TestFolder folder;
  std::string text = "time_s,current_a\n";
  for (int k = 0; k < 80; ++k)
    text += k < 40 ? fmt::format("23:59:59.{:03},1\n", 960 + k) : fmt::format("00:00:00.{:03},1\n", k - 40);
  EXPECT_NEAR(load({folder.write("midnight.csv", text)}).experiments[0].time_s.back(), 0.079, 1e-9);
}

TEST(TextFiles, LinesOfALoggersOwnBeforeTheNamesAreLeftOut) {
  const TestFolder folder;
  const fs::path path = folder.write("scope.csv", fifty("Recorder,Scope 7\nStarted,12.5.2024\n\nRate,1000,Hz\nt,i\n"));
  expect_fifty(only(path, kMapped));
  const Dataset data = load({folder.write("ours.csv", fifty("Recorder: Scope 7\n\ntime_s,current_a\nms,A\n"))});
  EXPECT_EQ(data.experiments[0].size(), 50u);
  EXPECT_NE(of_kind(data.findings, "header").at(0).what.find("1 lines before"), std::string::npos);
}

TEST(TextFiles, ColumnsMayBePartedByBlanks) {
  const TestFolder folder;
  expect_fifty(only(folder.write("blanks.csv", fifty("t i\n", " ")), kMapped));
  expect_fifty(only(folder.write("aligned.txt", fifty("  t      i  \n", "      ")), kMapped));
}

TEST(TextFiles, AHugeFieldIsNotEchoed) {
  const TestFolder folder;
  const std::string huge(20 << 20, 'x');
  std::string text = good_csv(100);
  text.insert(text.find('\n', text.size() / 2) + 1, "0," + huge + ",1,1\n");
  for (const std::string& content :
       {text, huge + "," + good_csv(100), "# gear_ratio: " + huge + "\n" + good_csv(100)}) {
    const std::string said = errors_text(folder.write("huge.csv", content));
    EXPECT_FALSE(said.empty());
    EXPECT_LT(said.size(), 10000u);
  }
}

TEST(TextFiles, LinesOfTheLoggerMayStandAboveNumbersWithDecimalCommas) {
  const TestFolder folder;
  std::string text = "SINUMERIK trace\nNC axis C1, sample cycle 1 ms\nt;i\n";
  for (int k = 0; k < 50; ++k) text += fmt::format("{},0;{},{:02}\n", k, k / 4, 25 * (k % 4));
  expect_fifty(only(folder.write("trace.csv", text), kMapped));
}

TEST(TextFiles, ASparseFileIsRefusedBeforeItIsInMemory) {
  const TestFolder folder;
  const fs::path zeros = folder.write("zeros.csv", "");
  fs::resize_file(zeros, std::uintmax_t{1} << 40);  // more than there is memory
  EXPECT_NE(errors_text(zeros).find("binary file"), std::string::npos);
  const fs::path cut = folder.write("cut.csv", good_csv(3000));
  fs::resize_file(cut, std::uintmax_t{1} << 40);
  EXPECT_NE(errors_text(cut).find("only zeros"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::data::data_text_files_test
