// When an image that was downloaded confirms itself: after two seconds of ticks in time and with a host.
#include "firmware/update_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::firmware_update_watch_test {
namespace {

struct Slots {
  bool is_on_trial = true, confirms = true;
  int confirmed = 0;
  bool on_trial() const { return is_on_trial; }
  bool confirm() {
    ++confirmed;
    return confirms;
  }
};
struct Watched {
  Slots slots;
  firmware::UpdateWatch<Slots> watch{slots, kTickHz};
  usb::DfuRuntime dfu;
  // Background work once a millisecond.
  void run(VirtualDrive& drive, double seconds, bool has_host = true) {
    for (int k = 0; k < 1000.0 * seconds; ++k) {
      drive.run(kTickHz / 1000);
      EXPECT_FALSE(watch.poll(drive.status(), has_host, dfu));
    }
  }
};

TEST(UpdateWatch, ConfirmsAnImageAfterTwoSecondsOfTicksInTime) {
  VirtualDrive drive({.drive = demo_drive()}, demo_block());
  Watched w;
  w.run(drive, 1.9);
  EXPECT_EQ(w.slots.confirmed, 0);
  w.run(drive, 0.2);
  EXPECT_EQ(w.slots.confirmed, 1);
  EXPECT_FALSE(w.watch.on_trial());
  w.run(drive, 1.0);
  EXPECT_EQ(w.slots.confirmed, 1);
}

TEST(UpdateWatch, WaitsForAHostAsTheNextUpdateNeedsOne) {
  VirtualDrive drive({.drive = demo_drive()}, demo_block());
  Watched w;
  w.run(drive, 3.0, false);
  EXPECT_EQ(w.slots.confirmed, 0);
  w.run(drive, 0.01);
  EXPECT_EQ(w.slots.confirmed, 1);
}

TEST(UpdateWatch, DoesNotConfirmAnImageWhoseTicksOverrunWhateverFaultCameFirst) {
  for (const bool has_other_fault : {false, true}) {
    VirtualDrive drive({.drive = demo_drive()}, demo_block());
    drive.run(100);
    if (has_other_fault) {
      drive.rig().inject(Injection::torque_out_of_range);
      drive.run(10);
      EXPECT_EQ(drive.status().fault.fault, Fault::torque_out_of_range);
    }
    drive.rig().inject(Injection::tick_overrun);
    Watched w;
    w.run(drive, 3.0);
    EXPECT_EQ(w.slots.confirmed, 0) << has_other_fault;
    drive.rig().clear(Injection::tick_overrun);
    w.run(drive, 1.9);
    EXPECT_EQ(w.slots.confirmed, 0) << has_other_fault;
    w.run(drive, 0.2);
    EXPECT_EQ(w.slots.confirmed, 1) << "two seconds after the last overrun";
  }
}

TEST(UpdateWatch, DoesNotWriteFlashWhileTheDriveIsArmed) {
  VirtualDrive drive({.drive = demo_drive()}, demo_block());
  drive.run(100);
  ASSERT_EQ(drive.command(arm_velocity(10.0)).refusal, Refusal::none);
  Watched w;
  for (int k = 0; k < 3000; ++k) {
    run_with_host(drive, 1e-3);
    w.watch.poll(drive.status(), true, w.dfu);
  }
  EXPECT_EQ(drive.status().mode, Mode::velocity);
  EXPECT_EQ(w.slots.confirmed, 0);
  drive.command(of_kind(Command::Kind::disarm));
  w.run(drive, 0.01);
  EXPECT_EQ(w.slots.confirmed, 1);
}

TEST(UpdateWatch, TriesAgainWhereTheMemoryFailed) {
  VirtualDrive drive({.drive = demo_drive()}, demo_block());
  Watched w;
  w.slots.confirms = false;
  w.run(drive, 2.5);
  EXPECT_GT(w.slots.confirmed, 1);
  EXPECT_TRUE(w.watch.on_trial());
  w.slots.confirms = true;
  w.run(drive, 0.01);
  EXPECT_FALSE(w.watch.on_trial());
}

}  // namespace
}  // namespace flexspline::tests::firmware_update_watch_test
