// host/app/workbench/live_drive: a drive that goes away and comes back.
#include "host/app/workbench/live_drive.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <thread>

#include "hil/twin/factory_block.hpp"
#include "hil/twin/twin_drive.hpp"
#include "host/app/workbench/closed_loop_run.hpp"
#include "host/drive_link/deployment/bases.hpp"
#include "tests/support/loopback.hpp"
#include "tests/unit/comparison_test_drive.hpp"

namespace flexspline::workbench::workbench_live_drive_test {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;
using protocol::Kind;

constexpr const char* kPlace = "tcp:here";

// A drive with a plug that can be pulled; counts what reaches the drive.
struct Bench {
  explicit Bench(std::string serial = "SN-1")
      : drive({.drive = plant::demo_plant().drive, .serial = std::move(serial)}) {
    drive.run(200);
  }
  twin::TwinDrive drive;
  std::atomic<bool> plugged{true};
  std::atomic<int> opened{0}, asked_to_open{0}, changes{0};
  std::atomic<int> pulled_at_chunk{-1};  // of a block on its way to the drive
};

class LinkFault final : public transport::Link {
 public:
  explicit LinkFault(Bench& bench) : bench_(bench), line_(bench.drive, {}) {}
  void send(const protocol::Message& m) override {
    if (m.request() == Kind::block_chunk && bench_.pulled_at_chunk-- == 0) bench_.plugged = false;
    require();
    if (m.request() == Kind::block_chunk || m.request() == Kind::block_commit || m.request() == Kind::block_restore)
      ++bench_.changes;
    line_.send(m);
  }
  std::optional<protocol::Message> receive(transport::Milliseconds limit) override {
    require();
    return line_.receive(limit);
  }
  std::string name() const override { return kPlace; }

 private:
  void require() const {
    if (!bench_.plugged) throw transport::LinkError("the plug was pulled");
  }
  Bench& bench_;
  tests::Loopback line_;
};

ConnectionOptions reaching(const std::shared_ptr<std::atomic<Bench*>>& there) {
  return {.open = [there](const std::string&) -> std::unique_ptr<transport::Link> {
            Bench& bench = **there;
            ++bench.asked_to_open;
            if (!bench.plugged) throw transport::LinkError("nothing is plugged in");
            ++bench.opened;
            return std::make_unique<LinkFault>(bench);
          },
          .first = 1ms,
          .most = 4ms};
}

class WorkbenchLiveDrive : public ::testing::Test {
 protected:
  WorkbenchLiveDrive() { live_.connect(kPlace); }
  // Looks at the drive, as a page does, until this holds.
  template <class Holds>
  json until(Holds holds) {
    for (;;) {
      live_.live(0);
      json status = live_.status();
      if (holds(status)) return status;
      std::this_thread::sleep_for(1ms);
    }
  }
  static bool is_connected(const json& status) { return status["connected"].get<bool>(); }
  static bool is_tried(const json& status) { return !status["again"].is_null() && status["again"]["attempts"] > 2; }

  Bench bench_;
  std::shared_ptr<std::atomic<Bench*>> there_ = std::make_shared<std::atomic<Bench*>>(&bench_);
  LiveDrive live_{kPlace, reaching(there_)};
};

model::Model other_model() {
  model::Model model = comparison::known_model(plant::demo_plant().drive);
  for (model::Effect& effect : model.effects)
    if (effect.type == "viscous_friction")
      for (model::Parameter& p : effect.parameters) p.value = 1.2 * *p.value;
  return model;
}

TEST_F(WorkbenchLiveDrive, ADriveThatWasLostIsConnectedAgainWhenItComesBackAndThatIsSaid) {
  bench_.plugged = false;
  json status = until(is_tried);
  EXPECT_FALSE(is_connected(status));
  EXPECT_EQ(status["problem"], "the plug was pulled");
  EXPECT_EQ(status["again"]["drive"], kPlace);
  EXPECT_EQ(status["again"]["why"], "nothing is plugged in");
  EXPECT_EQ(bench_.opened, 1);
  bench_.plugged = true;
  status = until(is_connected);
  EXPECT_EQ(status["came_back"], true);
  EXPECT_EQ(status["problem"], "");
  EXPECT_TRUE(status["again"].is_null());
  EXPECT_EQ(status["serial"], "SN-1");
  EXPECT_FALSE(status["block"].is_null());
  // Its signals come again.
  for (json live = live_.live(0); live["samples"].empty(); live = live_.live(0)) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(bench_.changes, 0);
}

TEST_F(WorkbenchLiveDrive, ADisconnectEndsTheAttempts) {
  bench_.plugged = false;
  until(is_tried);
  live_.disconnect();
  const json status = live_.status();
  EXPECT_TRUE(status["again"].is_null());
  EXPECT_EQ(status["problem"], "");
  bench_.plugged = true;
  // An attempt that was on its way may have been let in; what it brought is not taken.
  for (int k = 0; k < 50; ++k) {
    live_.live(0);
    EXPECT_FALSE(is_connected(live_.status()));
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_LE(bench_.opened, 2);
}

TEST_F(WorkbenchLiveDrive, AFlashThatLostItsDriveIsAnErrorAndIsNotDoneAgain) {
  const std::vector<std::uint8_t> before(bench_.drive.store().active().begin(), bench_.drive.store().active().end());
  bench_.pulled_at_chunk = 2;
  EXPECT_THROW(live_.flash(other_model(), [](std::string_view) {}), transport::LinkError);
  EXPECT_FALSE(is_connected(live_.status())) << "seen where it happened";
  EXPECT_EQ(bench_.changes, 2);
  bench_.plugged = true;
  until(is_connected);
  for (json live = live_.live(0); live["samples"].empty(); live = live_.live(0)) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(bench_.changes, 2) << "nothing that changes the drive went to it by itself";
  // The block before was given up, which takes a number of the store; nothing became active.
  const std::uint16_t number = bench_.drive.store().sequence();
  EXPECT_EQ(number, 3U);
  EXPECT_TRUE(std::ranges::equal(bench_.drive.store().active(), before));
  // A person may do it again.
  EXPECT_EQ(live_.flash(other_model(), [](std::string_view) {})["flashed"], true);
  EXPECT_EQ(bench_.drive.store().sequence(), bench_.drive.store().sequence_after(number)) << "once";
}

TEST_F(WorkbenchLiveDrive, APreviewChangesNothingAndNothingElseThanItShowsIsFlashed) {
  const auto say = [](std::string_view) {};
  const std::uint16_t first = bench_.drive.store().sequence();
  const json preview = live_.preview_flash(other_model(), say);
  EXPECT_EQ(bench_.drive.store().sequence(), first);
  const auto changed = std::ranges::find_if(preview["changes"], [](const json& c) { return c["change"] != "same"; });
  ASSERT_NE(changed, preview["changes"].end());
  const PreviewedBlocks shown{preview["before"]["sha256"], preview["after"]["sha256"]};
  // The model is another one by now.
  const model::Model known = comparison::known_model(plant::demo_plant().drive);
  EXPECT_THROW(live_.flash(known, say, shown), drive::DriveError);
  EXPECT_EQ(bench_.drive.store().sequence(), first);
  EXPECT_EQ(live_.flash(other_model(), say, shown)["flashed"], true);
  const std::uint16_t second = bench_.drive.store().sequence();
  EXPECT_NE(second, first);
  // The drive has another block by now.
  EXPECT_THROW(live_.flash(known, say, shown), drive::DriveError);
  const json back = live_.preview_restore();
  EXPECT_EQ(back["after"]["sha256"], shown.before);
  EXPECT_EQ(bench_.drive.store().sequence(), second);
  EXPECT_THROW(live_.restore(shown), drive::DriveError);
  live_.restore(PreviewedBlocks{shown.after, shown.before});
  EXPECT_EQ(live_.status()["block"]["sha256"], shown.before);
}

TEST_F(WorkbenchLiveDrive, APreviewComesWithTheGainThatFlashPredicts) {
  const auto say = [](std::string_view) {};
  ComparedBlocks blocks;
  live_.preview_flash(other_model(), say, &blocks);
  ASSERT_FALSE(blocks.made.empty());
  EXPECT_TRUE(std::ranges::equal(blocks.active, bench_.drive.store().active()));
  std::size_t runs = 0;
  const closed_loop::Runner run = [&](const std::vector<closed_loop::Job>& jobs) {
    std::vector<closed_loop::Outcome> outcomes(jobs.size());
    for (std::size_t k = 0; k < jobs.size(); ++k) outcomes[k].rms_error_rad = jobs[k].compensation ? 2e-4 : 1e-3;
    runs += jobs.size();
    return outcomes;
  };
  const json found = predicted_gain(other_model(), blocks, run, say);
  EXPECT_NEAR(found["ratio"].get<double>(), 0.2, 1e-9) << found;
  EXPECT_NE(found["in_words"].get<std::string>().find("0.2 mrad with this model, 1 mrad without"), std::string::npos)
      << found;
  EXPECT_GE(runs, 8u);
  const closed_loop::Runner broken = [](const std::vector<closed_loop::Job>&) -> std::vector<closed_loop::Outcome> {
    throw std::runtime_error("there is no twin");
  };
  EXPECT_EQ(predicted_gain(other_model(), blocks, broken, say)["problem"], "there is no twin");
}

TEST_F(WorkbenchLiveDrive, AnotherDriveInItsPlaceIsNotConnected) {
  Bench other("SN-2");
  bench_.plugged = false;
  until(is_tried);
  *there_ = &other;
  const json status = until([](const json& s) { return s["again"].is_null(); });
  EXPECT_FALSE(is_connected(status));
  EXPECT_NE(status["problem"].get<std::string>().find("another drive now, SN-2"), std::string::npos) << status;
  // A person may.
  live_.connect(kPlace);
  EXPECT_EQ(live_.status()["serial"], "SN-2");
  live_.disconnect();
}

}  // namespace
}  // namespace flexspline::workbench::workbench_live_drive_test
