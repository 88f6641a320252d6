// The main loop over the links of a drive.
#include "firmware/main_loop.hpp"

#include <gtest/gtest.h>

#include <string>

#include "firmware/service.hpp"

namespace flexspline::tests::firmware_main_loop_test {
namespace {

// Writes down what is polled.
struct Polled {
  std::string& order;
  char name;
  bool has_host = false;
  bool poll() {
    order += name;
    return has_host;
  }
  void background() { order += name; }
};

struct Loop {
  std::string order;
  Polled application{order, 'a'}, service{order, 's'}, usb{order, 'u'}, can{order, 'c'}, line{order, 'l'};
  firmware::MainLoop<Polled, Polled, Polled, Polled, Polled> drive{application, service, usb, can, line};
  std::string one_pass() {
    order.clear();
    drive.poll();
    return order;
  }
};

TEST(MainLoop, PollsEachLinkInTheOrderOfTheListAndThenTheBackgroundWork) {
  EXPECT_EQ(Loop().one_pass(), "uclas");
}

TEST(MainLoop, PassesOverTheLinksAfterOneThatHasAHost) {
  Loop loop;
  loop.can.has_host = true;
  EXPECT_EQ(loop.one_pass(), "ucas");
  loop.usb.has_host = true;
  EXPECT_EQ(loop.one_pass(), "uas");
  loop.usb.has_host = loop.can.has_host = false;
  EXPECT_EQ(loop.one_pass(), "uclas");
}

TEST(DriveInfo, NamesAreCutToWhatTheMessageHoldsAndEndWithAZero) {
  const auto info = firmware::DriveInfo::of({1, 2}, "a board with a long name", "0123");
  EXPECT_EQ(info.firmware[1], 2);
  EXPECT_EQ(std::string(info.board.begin(), info.board.end()), std::string("a board with a ") + '\0');
  EXPECT_EQ(std::string(info.serial.begin(), info.serial.end()), "0123" + std::string(12, '\0'));
}

}  // namespace
}  // namespace flexspline::tests::firmware_main_loop_test
