// A warning that many files share is one line that names them.
#include <gtest/gtest.h>

#include "host/input/data/finding.hpp"

namespace flexspline::data::data_warning_texts_test {
namespace {

Finding gap_in(const std::string& file, const std::string& what = "12 samples are missing") {
  return {Severity::warning, "gap", "logs/" + file, 0, "time_s", what, "find out why"};
}

TEST(WarningTexts, OfTwoFilesAreTwo) {
  EXPECT_EQ(warning_texts({gap_in("a.csv"), gap_in("b.csv")}).size(), 2U);
}

TEST(WarningTexts, OfThreeFilesAreOneThatNamesTheOthers) {
  const std::vector<std::string> texts =
      warning_texts({gap_in("a.csv"), gap_in("b.csv", "7 samples are missing"), gap_in("c.csv")});
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_EQ(texts[0],
            "logs/a.csv, column time_s: 12 samples are missing; find out why (likewise in 2 more files: b.csv, c.csv; "
            "flexspline check lists each)");
}

TEST(WarningTexts, KeepWhatDiffersInKindColumnOrRemedy) {
  std::vector<Finding> findings = {gap_in("a.csv"), gap_in("b.csv"), gap_in("c.csv"), gap_in("a.csv")};
  findings[1].column = "current_a";
  findings[2].remedy = "record again";
  findings.back().severity = Severity::note;
  EXPECT_EQ(warning_texts(findings).size(), 3U);
}

TEST(WarningTexts, OfOneFileStayApart) {
  EXPECT_EQ(warning_texts({gap_in("a.csv", "1"), gap_in("a.csv", "2"), gap_in("a.csv", "3")}).size(), 3U);
}

TEST(WarningTexts, ErrorsOfOneKindAreJoinedLikewise) {
  std::vector<Finding> findings = {gap_in("a.csv"), gap_in("b.csv"), gap_in("c.csv"), gap_in("d.csv")};
  for (Finding& finding : findings) finding.severity = Severity::error;
  EXPECT_TRUE(warning_texts(findings).empty());
  EXPECT_EQ(texts_of(findings, Severity::error).size(), 1U);
}

}  // namespace
}  // namespace flexspline::data::data_warning_texts_test
