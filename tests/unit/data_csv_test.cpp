// host/input/data: CSV as loggers write it, and what is refused.
#include <gtest/gtest.h>

#include <bit>
#include <cstdlib>
#include <random>

#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_csv_test {
namespace {

// Forty rows of time and a current of row / 4, in the given spelling.
std::string rows(const std::string& header, const std::string& separator, bool decimal_comma,
                 const std::string& line_end) {
  std::string text = header + line_end;
  for (int k = 0; k < 40; ++k) {
    std::string time = fmt::format("{:.3f}", 0.001 * k);
    std::string amps = fmt::format("{:.2f}", 0.25 * k);
    if (decimal_comma) {
      time.replace(time.find('.'), 1, ",");
      amps.replace(amps.find('.'), 1, ",");
    }
    text += time + separator + amps + line_end;
  }
  return text;
}

void expect_ramp(const std::filesystem::path& file) {
  const Dataset data = load({file});
  ASSERT_EQ(data.experiments.size(), 1u);
  const Experiment& e = data.experiments[0];
  ASSERT_EQ(e.size(), 40u);
  EXPECT_NEAR(e.sample_s, 0.001, 1e-12);
  for (std::size_t k = 0; k < 40; ++k) {
    ASSERT_DOUBLE_EQ(e[Column::current][k], 0.25 * static_cast<double>(k));
    ASSERT_NEAR(e.time_s[k], 0.001 * static_cast<double>(k), 1e-12);
  }
}

TEST(Csv, SeparatorsLineEndsAndDecimalCommasAllReadTheSame) {
  const TestFolder folder;
  expect_ramp(folder.write("comma.csv", rows("time_s,current_a", ",", false, "\n")));
  expect_ramp(folder.write("semicolon.csv", rows("time_s;current_a", ";", false, "\r\n")));
  expect_ramp(folder.write("decimal_comma.csv", rows("time_s;current_a", ";", true, "\n")));
  expect_ramp(folder.write("tab.tsv", rows("time_s\tcurrent_a", "\t", true, "\r\n")));
  expect_ramp(folder.write("blanks.csv", rows("time_s , current_a", " , ", false, "\n")));
  expect_ramp(folder.write("old_mac.csv", rows("time_s,current_a", ",", false, "\r")));
  expect_ramp(folder.write("mark.csv", "\xEF\xBB\xBF" + rows("\"time_s\",\"current_a\"", ",", false, "\r\n")));
  expect_ramp(folder.write("tail.csv", rows("time_s,current_a,", ",", false, ",\n") + "\n\n,,\n"));
  expect_ramp(folder.write("numpy.csv", rows("# time_s,current_a", ",", false, "\n")));
  expect_ramp(folder.write("no_last_line_end.csv", [] {
    std::string text = rows("time_s,current_a", ",", false, "\n");
    text.pop_back();
    return text;
  }()));
}

// Settings may be pairs of a name and a number, or words between blanks: neither is a header with a line of data.
TEST(Csv, SettingsBeforeTheNamesArePassedOver) {
  const TestFolder folder;
  for (const std::string settings : {"Drive log v2\nSerial: 1234\n\n", "Title,Scope 1\nRate,1000\nGain,2\n",
                                     "Rate,1000\nStart,2026-03-01 10:00\n\n", "Recorder\n"}) {
    expect_ramp(folder.write("run.csv", settings + rows("time_s,current_a", ",", false, "\n")));
    expect_ramp(folder.write("run.csv", settings + rows("time_s\tcurrent_a", "\t", false, "\n")));
    // The name of a state between the numbers.
    expect_ramp(folder.write("run.csv", settings + rows("time_s;state;current_a", ";RUN;", false, "\n")));
  }
}

TEST(Csv, QuotedTextInAnUnknownColumnMayHoldSeparators) {
  const TestFolder folder;
  std::string text = "state,time_s,\"current_a\"\n";
  for (int k = 0; k < 40; ++k) text += fmt::format("\"run, {}\",{},\"+{}e-2\"\n", k, k * 0.001, k * 25);
  expect_ramp(folder.write("quoted.csv", text));
}

TEST(Csv, UnknownColumnsStayOutOfMemoryAndANoteListsThem) {
  const TestFolder folder;
  const Dataset data =
      load({folder.write("a.csv", csv_of(even_times(100), {{"current_a", current}, {"bus_voltage", position}}))});
  ASSERT_EQ(of_kind(data.findings, "unused_column").size(), 1u);
  const Finding note = of_kind(data.findings, "unused_column")[0];
  EXPECT_EQ(note.severity, Severity::note);
  EXPECT_NE(note.what.find("bus_voltage"), std::string::npos);
  EXPECT_EQ(data.experiments[0].unused_columns, std::vector<std::string>{"bus_voltage"});
}

TEST(Csv, ANearlyRightColumnNameIsAWarningWithTheRightOne) {
  const TestFolder folder;
  const Dataset data = load(
      {folder.write("a.csv", csv_of(even_times(100), {{"current_a", current}, {"motor_velocity_rad", velocity}}))});
  const std::vector<Finding> found = of_kind(data.findings, "unused_column");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::warning);
  EXPECT_NE(found[0].remedy.find("motor_velocity_rad_s"), std::string::npos);
}

TEST(Csv, TextInANumberIsNamedWithFileLineAndColumn) {
  const TestFolder folder;
  std::string text = good_csv(100);
  const std::size_t third = text.find('\n', text.find('\n', text.find('\n') + 1) + 1) + 1;
  text.insert(text.find(',', third) + 1, "oops");
  const std::filesystem::path file = folder.write("bad.csv", text);
  const std::vector<Finding> errors = errors_of({file});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "text_in_number");
  EXPECT_EQ(errors[0].file, file.string());
  EXPECT_EQ(errors[0].line, 4u);
  EXPECT_EQ(errors[0].column, "current_a");
  EXPECT_NE(errors[0].text().find(":4, column current_a: \"oops"), std::string::npos) << errors[0].text();
}

TEST(Csv, NanInfinityAndMissingValuesAreErrorsAndToleratedTheyAreCutOutAsGaps) {
  for (const std::string bad : {"nan", "NaN", "inf", "-Infinity", "", "NA", "1e999"}) {
    const TestFolder folder;
    std::string text = "time_s,current_a\n";
    for (int k = 0; k < 100; ++k)
      text += fmt::format("{:.3f},{}\n", 0.001 * k, k >= 50 && k < 55 ? bad : fmt::format("{}", k % 7));
    const std::filesystem::path file = folder.write("nan.csv", text);
    const std::vector<Finding> errors = errors_of({file});
    ASSERT_EQ(errors.size(), 1u) << bad;
    EXPECT_EQ(errors[0].kind, "not_finite");
    EXPECT_EQ(errors[0].line, 52u);
    EXPECT_NE(errors[0].what.find("4 more"), std::string::npos);

    const Dataset data = load({file}, tolerating("not_finite"));
    const Experiment& e = data.experiments[0];
    ASSERT_EQ(e.segments.size(), 2u);
    EXPECT_EQ(e.size(), 95u);
    EXPECT_EQ(e.segments[0].last, 50u);
    EXPECT_NEAR(e.time_s[50], 0.055, 1e-12);
    ASSERT_EQ(of_kind(data.findings, "not_finite").size(), 1u);
    EXPECT_EQ(of_kind(data.findings, "not_finite")[0].severity, Severity::warning);
  }
}

TEST(Csv, AnEmptyColumnCountsAsNotMeasured) {
  const TestFolder folder;
  std::string text = "time_s,current_a,torque_nm\n";
  for (int k = 0; k < 60; ++k) text += fmt::format("{:.3f},{},\n", 0.001 * k, k % 5);
  const Dataset data = load({folder.write("a.csv", text)});
  EXPECT_FALSE(data.has(Column::torque));
  EXPECT_TRUE(data.has(Column::current));
  ASSERT_EQ(of_kind(data.findings, "empty_column").size(), 1u);
  EXPECT_EQ(of_kind(data.findings, "empty_column")[0].column, "torque_nm");
}

TEST(Csv, ALineCutShortIsAnErrorAndToleratedItIsLeftOut) {
  const TestFolder folder;
  const std::filesystem::path file = folder.write("cut.csv", good_csv(100) + "0.100000000,0.3");
  const std::vector<Finding> errors = errors_of({file});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "row_length");
  EXPECT_EQ(errors[0].line, 102u);
  EXPECT_EQ(load({file}, tolerating("row_length")).experiments[0].size(), 100u);
}

TEST(Csv, DecimalCommasBetweenCommasAreRefused) {
  const TestFolder folder;
  const std::vector<Finding> errors = errors_of({folder.write("a.csv", rows("time_s,current_a", ",", true, "\n"))});
  ASSERT_FALSE(errors.empty());
  EXPECT_EQ(errors[0].kind, "row_length");
  EXPECT_NE(errors[0].remedy.find("semicolon"), std::string::npos);
}

TEST(Csv, CommasAsThousandsAmongDecimalPointsAreNotTakenForDecimals) {
  const TestFolder folder;
  std::string text = rows("time_s;current_a", ";", false, "\n");
  text += "0.040;1,000\n";
  const std::vector<Finding> errors = errors_of({folder.write("a.csv", text)});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "text_in_number");
  EXPECT_EQ(errors[0].line, 42u);
}

struct Refused {
  std::string name;
  std::string text;
  std::string kind;
  std::string word;  // in what is wrong or what to do
};

TEST(Csv, FilesThatAreNoMeasurementAreRefusedByWhatTheyAre) {
  const std::vector<Refused> files = {
      {"empty.csv", "", "header", "empty"},
      {"blank.csv", "\n\r\n  \n", "header", "empty"},
      {"comments.csv", "# experiment: a\n# load: free\n", "header", "comments"},
      {"header_only.csv", "time_s,current_a\n", "too_few_samples", "no data"},
      {"numbers.csv", "0.0,1.0\n0.1,1.0\n", "header", "first line"},
      {"binary.csv", std::string("PK\3\4\0\0\0abc", 10), "format", "binary"},
      {"utf16.csv", std::string("\xFF\xFEt\0i\0", 6), "format", "UTF-8"},
      {"old.mat", "MATLAB 5.0 MAT-file, Platform: GLNXA64", "format", "CSV"},
      {"short.csv", rows("time_s,current_a", ",", false, "\n").substr(0, 116), "too_few_samples", "longer"},
      {"no_time.csv", "t,current_a\n1,2\n", "missing_column", "columns.time_s"},
      {"nothing_known.csv", "time_s,voltage\n1,2\n", "missing_column", "voltage"},
      {"twice.csv", rows("time_s,current_a,current_a", ",1,", false, "\n"), "header", "twice"},
  };
  for (const Refused& refused : files) {
    const TestFolder folder;
    const std::filesystem::path file = folder.write(refused.name, refused.text);
    const std::vector<Finding> errors = errors_of({file});
    ASSERT_FALSE(errors.empty()) << refused.name;
    EXPECT_EQ(errors[0].kind, refused.kind) << errors[0].text();
    EXPECT_EQ(errors[0].file, file.string());
    EXPECT_NE(errors[0].text().find(refused.word), std::string::npos) << errors[0].text();
    EXPECT_FALSE(errors[0].remedy.empty()) << refused.name;
  }
}

TEST(Csv, PathsThatLeadNowhereAreSaid) {
  const TestFolder folder;
  for (const std::filesystem::path& path : {folder.path(), folder.path() / "absent.csv"}) {
    const std::vector<Finding> errors = errors_of({path});
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_EQ(errors[0].kind, "file");
    EXPECT_EQ(errors[0].file, path.string());
    EXPECT_FALSE(errors[0].remedy.empty());
  }
  EXPECT_EQ(errors_of({}).size(), 1u);
}

// Digits with a point take a path of their own; both sides of its limits, and ways to write that it must not take.
TEST(Csv, NumbersAreReadToTheLastBitHoweverTheyAreWritten) {
  std::vector<std::string> written = {"0",

                                      "5.",
                                      ".5",
                                      "-.25",
                                      "007.50",
                                      "9007199254740991",
                                      "9007199254740993",
                                      "0.1",
                                      "1e-3",
                                      "2.5E2",
                                      "123456789.123456789",
                                      "0.1234567890123456789",
                                      "0.00000000000000000000123",
                                      "18446744073709551617",
                                      "99999999999999999999.5"};
  std::mt19937_64 random(1);
  for (int k = 0; k < 20000; ++k) {
    const double x = std::ldexp(static_cast<double>(random()) - 9.2e18, -static_cast<int>(random() % 70));
    written.push_back(fmt::format("{:.{}f}", x, random() % 12));
    written.push_back(fmt::format("{:.17g}", x));
    written.push_back(fmt::format("{:.6g}", x));
  }
  std::string text = "time_s,current_a\n";
  for (std::size_t k = 0; k < written.size(); ++k)
    text += fmt::format("{:.3f},{}\n", 1e-3 * static_cast<double>(k), written[k]);
  const TestFolder folder;
  const Dataset data = load({folder.write("numbers.csv", text)});
  const std::vector<double>& read = data.experiments.at(0)[Column::current];
  ASSERT_EQ(read.size(), written.size());
  for (std::size_t k = 0; k < written.size(); ++k) {
    const double expected = std::strtod(written[k].c_str(), nullptr) + 0.0;  // a zero has no sign
    ASSERT_EQ(std::bit_cast<std::uint64_t>(read[k]), std::bit_cast<std::uint64_t>(expected)) << written[k];
  }
}

TEST(Csv, AllErrorsOfAllFilesAreToldAtOnce) {
  const TestFolder folder;
  folder.write("a.csv", "time_s,current_a\n0,x\n" + rows("", ",", false, "\n"));
  folder.write("b.csv", "time_s,current_a\n");
  const std::vector<Finding> errors = errors_of({folder.path()});
  ASSERT_EQ(errors.size(), 2u);
  EXPECT_EQ(errors[0].kind, "text_in_number");
  EXPECT_EQ(errors[1].kind, "too_few_samples");
}

TEST(Csv, AFolderIsReadInTheOrderOfNames) {
  const TestFolder folder;
  folder.write("b.csv", good_csv(64));
  folder.write("a.csv", good_csv(100));
  folder.write("notes.txt", "no measurement");
  const Dataset data = load({folder.path()});
  ASSERT_EQ(data.experiments.size(), 2u);
  EXPECT_EQ(data.experiments[0].name, "a");
  EXPECT_EQ(data.experiments[1].name, "b");
}

}  // namespace
}  // namespace flexspline::data::data_csv_test
