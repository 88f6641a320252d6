// Sends reports to an echo device by hidapi and counts those that come back as they were. Built once for each of
// hidapi's two ways to a device on Linux.
//   echo_check echo SERIAL COUNT    one after the other, then in bursts
//   echo_check pull SERIAL          has the plug pulled: the open device has to fail, not to hang
#include <hidapi/hidapi.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "shared/usb/identity.hpp"

namespace {

using Identity = flexspline::usb::FlexsplineIdentity;
using Message = std::array<unsigned char, 65>;  // hidapi puts the number of the report before it

constexpr int kPatienceMs = 2000;
constexpr int kBurst = 4;

[[noreturn]] void fail(const char* what, int i = 0) {
  std::printf("echo_check: %s (%d)\n", what, i);
  std::exit(1);
}
Message message(int i) {
  Message m{};
  for (std::size_t k = 1; k < m.size(); ++k) m[k] = static_cast<unsigned char>(i * 7 + static_cast<int>(k)) & 0x7f;
  return m;
}
void write(hid_device* device, int i) {
  const Message m = message(i);
  if (hid_write(device, m.data(), m.size()) != static_cast<int>(m.size())) fail("a report was not taken", i);
}
void expect(hid_device* device, int i) {
  std::array<unsigned char, 128> got{};
  const int n = hid_read_timeout(device, got.data(), got.size(), kPatienceMs);
  if (n != 64) fail("no report of 64 bytes came back", n);
  if (std::memcmp(got.data(), message(i).data() + 1, 64) != 0) fail("another report came back", i);
}

int echo(hid_device* device, int count) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < count; ++i) {
    write(device, i);
    expect(device, i);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (int i = 0; i < count; i += kBurst) {
    for (int k = 0; k < kBurst; ++k) write(device, i + k);
    for (int k = 0; k < kBurst; ++k) expect(device, i + k);
  }
  std::array<unsigned char, 64> got{};
  if (hid_read_timeout(device, got.data(), got.size(), 20) != 0) fail("more came than was sent");
  std::printf("%d reports and %d in bursts came back, %.0f round trips a second\n", count, count, count / seconds);
  return 0;
}

int pull(hid_device* device) {
  Message m{};
  m[1] = 0xfe;
  if (hid_write(device, m.data(), m.size()) < 0) fail("the request to pull the plug was not taken");
  std::array<unsigned char, 64> got{};
  const auto start = std::chrono::steady_clock::now();
  while (hid_read_timeout(device, got.data(), got.size(), 500) >= 0) {
    if (std::chrono::steady_clock::now() - start > std::chrono::seconds(10)) fail("reading goes on without a device");
  }
  if (hid_write(device, message(1).data(), 65) >= 0) fail("writing goes on without a device");
  std::printf("the open device failed when its plug was pulled\n");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) fail("usage: echo_check echo|pull SERIAL [COUNT]");
  if (hid_init() != 0) fail("hidapi does not start");
  const std::string serial = argv[2];
  hid_device* device = nullptr;
  hid_device_info* all = hid_enumerate(Identity::kVendorId, Identity::kProductId);
  for (const hid_device_info* info = all; info != nullptr; info = info->next) {
    if (info->serial_number == nullptr || std::wstring(serial.begin(), serial.end()) != info->serial_number) continue;
    if (std::wstring(Identity::kProduct.begin(), Identity::kProduct.end()) != info->product_string)
      fail("another product string");
    device = hid_open_path(info->path);
  }
  hid_free_enumeration(all);
  if (device == nullptr) fail("no such device, or it cannot be opened");
  const int status = std::string(argv[1]) == "pull" ? pull(device) : echo(device, argc > 3 ? std::atoi(argv[3]) : 100);
  hid_close(device);
  hid_exit();
  return status;
}
