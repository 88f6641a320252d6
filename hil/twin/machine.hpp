#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "firmware/boot_loader.hpp"
#include "hil/twin/flash_file.hpp"
#include "hil/twin/image.hpp"
#include "hil/usbip/server.hpp"
#include "shared/boot/development_key.hpp"

namespace flexspline::twin {

/// The twin's board for the boot loader.
struct LoaderBoard {
  using Slots = ImageFlash;
  using Trust = boot::SignedBy<boot::kDevelopmentKey>;
  static constexpr bool kCanUpload = true;
  static constexpr std::string_view kName = kBoardName;
  static constexpr std::uint32_t kEraseMs = 50, kBlockMs = 2, kCheckMs = 20;

  Slots& slots() { return flash; }
  bool takes_loader_request() { return std::exchange(request, false); }

  ImageFlash flash;
  bool request = false;
};

/// The twin's parts other than its application: memory for firmware images, and the drive's own boot loader. Each start
/// depends on that memory only.
class Machine {
 public:
  using Loader = firmware::BootLoader<LoaderBoard>;
  using Slots = Loader::Slots;

  /// `file` holds the images (empty: they end with the twin). Where nothing was ever installed, `as_made` installs the
  /// factory image. Throws std::runtime_error where the file is not such a memory.
  Machine(const std::filesystem::path& file, bool as_made);

  /// A reset. True: an application was started, which may hang; false: the boot loader waits for a host.
  bool start();
  /// Of the application that was started.
  boot::Version version() const { return version_; }
  bool hangs() const { return hangs_; }
  /// The same memory, for the application.
  Slots& slots() { return slots_; }
  /// The application's request for the next start.
  void request_loader() { board_.request = true; }

  /// Runs the boot loader on the bus, until it resets the machine or `over` returns that the twin ends.
  void serve_loader(usbip::Server& bus, std::string_view bus_id, const std::string& serial,
                    const std::function<bool()>& over);

 private:
  LoaderBoard board_;
  Slots slots_;
  std::optional<Loader> loader_;
  boot::Version version_{};
  bool hangs_ = false;
};

}  // namespace flexspline::twin
