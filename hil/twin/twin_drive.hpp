#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "firmware/service.hpp"
#include "hil/board/controller.hpp"
#include "hil/board/plant_rig.hpp"
#include "hil/twin/flash_file.hpp"
#include "hil/twin/image.hpp"

namespace flexspline::twin {

struct TwinSetup {
  plant::Drive drive{};
  std::uint64_t seed = 1;
  std::string serial = "TWIN";
  std::filesystem::path flash_file{};  ///< empty: the memory ends with the twin
  bool as_made = true;                 ///< an empty flash memory gets the factory block
  bool locked = false;                 ///< the output
  /// The motor's angle when the drive is switched on, turns; none: random within two turns, by the seed.
  std::optional<double> start_turns{};
  control::SensorKind encoders = control::SensorKind::absolute;
  bool three_phase = false;  ///< board::RigSetup::three_phase, with this motor
  std::optional<board::ThreePhaseParameters> motor{};
  FlashFile* flash = nullptr;  ///< memory that outlives the drive, instead of the file
  PairingFile* pairing = nullptr;
  boot::Version version = kFactoryVersion;
};

using TwinApplication = firmware::Application<board::SoftwareBoard>;

using TwinBlocks = firmware::ApplicationBlocks<TwinApplication, board::SoftwareBoard::kTickHz>;

/// A whole drive: plant, sensors, the firmware's application and its service for a host, and flash memory. Time passes
/// only in run().
class TwinDrive {
 public:
  using Store = storage::ParameterStore<FlashFile>;
  using Pairing = storage::PairingMemory<PairingFile>;
  using Lock = firmware::ParameterLock<Pairing, board::SoftwareBoard>;
  using Service = firmware::Service<TwinApplication, Store, TwinBlocks, Lock>;

  explicit TwinDrive(const TwinSetup& setup);

  /// One tick, and the background work until the next.
  void tick();
  void run(std::uint32_t ticks) {
    for (std::uint32_t i = 0; i < ticks; ++i) tick();
  }
  Service& service() { return *service_; }
  const firmware::Status& status() const { return application_.status(); }
  const Store& store() const { return store_; }
  const Lock& lock() const { return lock_; }
  board::PlantRig& rig() { return rig_; }

 private:
  TwinSetup setup_;
  board::PlantRig rig_;
  board::SoftwareBoard board_;
  TwinApplication application_;
  std::unique_ptr<FlashFile> own_flash_;
  Store store_;
  TwinBlocks blocks_{application_};
  std::unique_ptr<PairingFile> own_pairing_;
  Pairing pairing_;
  Lock lock_{pairing_, board_};
  std::unique_ptr<Service> service_;
};

}  // namespace flexspline::twin
