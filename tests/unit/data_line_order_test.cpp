// host/input/data: lines that stand twice or in another order.
#include <gtest/gtest.h>

#include <numeric>

#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_line_order_test {
namespace {

// A hundred samples in this order.
std::string in_order(const std::vector<int>& order) {
  std::string text = "time_s,current_a\n";
  for (const int k : order) text += fmt::format("{:.3f},{}\n", 0.001 * k, k % 7);
  return text;
}
std::vector<int> hundred() {
  std::vector<int> order(100);
  std::iota(order.begin(), order.end(), 0);
  return order;
}

TEST(LineOrder, RepeatedAndSwappedLinesAreErrorsThatNameTheOptionAndToleratedTheyAreUsedOnce) {
  const TestFolder folder;
  std::vector<int> order = hundred();
  std::swap(order[40], order[41]);
  order.insert(order.begin() + 70, order[70]);
  const auto path = folder.write("run.csv", in_order(order));
  const std::vector<Finding> errors = errors_of({path});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "time_not_increasing");
  EXPECT_NE(errors[0].remedy.find("--tolerate time_not_increasing"), std::string::npos);

  const Dataset data = load({path}, tolerating("time_not_increasing"));
  EXPECT_EQ(data.experiments[0].columns, load({folder.write("good.csv", in_order(hundred()))}).experiments[0].columns);
  const std::vector<Finding> warnings = of_kind(data.findings, "time_not_increasing");
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].severity, Severity::warning);
  EXPECT_NE(warnings[0].what.find("1 lines repeat"), std::string::npos) << warnings[0].what;
  EXPECT_NE(warnings[0].what.find("1 are out of order"), std::string::npos) << warnings[0].what;
}

TEST(LineOrder, LinesOfOneTimeThatDifferCannotBeTolerated) {
  const TestFolder folder;
  std::string text = in_order(hundred());
  text += "0.099,3\n";
  EXPECT_FALSE(errors_of({folder.write("run.csv", text)}, tolerating("time_not_increasing")).empty());
}

TEST(LineOrder, RecordingsOneAfterTheOtherAreNotMixed) {
  const TestFolder folder;
  std::vector<int> order = hundred();
  for (int k = 50; k < 100; ++k) order.push_back(k);
  EXPECT_FALSE(errors_of({folder.write("run.csv", in_order(order))}, tolerating("time_not_increasing")).empty());
}

}  // namespace
}  // namespace flexspline::data::data_line_order_test
