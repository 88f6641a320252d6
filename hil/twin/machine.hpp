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

namespace flexspline::twin {

/// What the boot loader sees of the twin's board.
struct LoaderBoard {
  using Slots = ImageFlash;
  static constexpr std::string_view kName = kBoardName;
  static constexpr std::uint32_t kEraseMs = 50, kBlockMs = 2, kCheckMs = 20;

  Slots& slots() { return flash; }
  bool takes_loader_request() { return std::exchange(request, false); }

  ImageFlash flash;
  bool request = false;
};

/// What the twin has beside its application: memory for firmware images, and the drive's own boot loader. Each start
/// begins with nothing but what is in that memory.
class Machine {
 public:
  using Loader = firmware::BootLoader<LoaderBoard>;
  using Slots = Loader::Slots;

  /// `file` holds the images (empty: they end with the twin). Where nothing was ever installed, `as_made` puts in what
  /// the twin leaves its maker with. Throws std::runtime_error where the file is no such memory.
  Machine(const std::filesystem::path& file, bool as_made);

  /// A reset. True: an application was started, which may hang; false: the boot loader waits for a host.
  bool start();
  /// Of the application that was started.
  boot::Version version() const { return version_; }
  bool hangs() const { return hangs_; }
  /// The same memory, for the application.
  Slots& slots() { return slots_; }
  /// The application's note for the next start.
  void ask_for_loader() { board_.request = true; }

  /// The boot loader on the bus, until it resets the machine or `over` says that the twin ends.
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
