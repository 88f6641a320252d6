// One recording of the twin and one fit, for all tests of a suite.
#pragma once

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test {

// demo-out and fitted.toml in the folder of shell_. Suites run one after the other.
class FittedDemo : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shell_ = new Shell;
    shell_->record_and_identify();
  }
  static void TearDownTestSuite() {
    delete shell_;
    shell_ = nullptr;
  }
  static inline Shell* shell_ = nullptr;
};

}  // namespace flexspline::cli_test
