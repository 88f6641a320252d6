// Signatures, good and broken in fifteen ways (whole: a hundred thousand): the drive's verification judges each as
// libsodium does.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

#include "tests/support/campaign_size.hpp"
#include "tests/support/signature_cases.hpp"

namespace flexspline::tests::boot_signature_test {
namespace {

TEST(BootSignatureCampaign, LibsodiumJudgesSignaturesAsTheDriveDoes) {
  const std::size_t cases = in_campaign<std::size_t>(16'000, 100'000), of_each = cases / 16;
  const Agreement agreement = agreement_with_libsodium(cases, 20);
  EXPECT_EQ(agreement.differ, std::vector<std::string>{});
  std::size_t accepted = 0;
  for (const auto& [kind, count] : agreement.by_kind) {
    std::printf("%-18s accepted %5zu, refused %5zu\n", kind.c_str(), count[0], count[1]);
    accepted += count[0];
  }
  EXPECT_EQ(agreement.by_kind.at("good"), (std::array<std::size_t, 2>{of_each, 0}));
  // One of eight keys of mixed order.
  const double share = static_cast<double>(agreement.by_kind.at("A of mixed order")[0]) / static_cast<double>(of_each);
  EXPECT_NEAR(share, 0.125, 0.02);
  EXPECT_EQ(accepted, of_each + agreement.by_kind.at("A of mixed order")[0]) << "nothing else is accepted";
}

}  // namespace
}  // namespace flexspline::tests::boot_signature_test
