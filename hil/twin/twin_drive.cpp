#include "hil/twin/twin_drive.hpp"

#include <algorithm>
#include <span>
#include <stdexcept>

#include "hil/twin/factory_block.hpp"

namespace flexspline::twin {
namespace {

template <std::size_t Size>
std::array<std::uint8_t, Size> text_in(const std::string& text) {
  std::array<std::uint8_t, Size> bytes{};
  std::copy_n(text.begin(), std::min(text.size(), Size - 1), bytes.begin());
  return bytes;
}

std::filesystem::path pairing_file_of(std::filesystem::path flash_file) {
  return flash_file.empty() ? flash_file : flash_file += ".pairing";
}

// A locked output is at its zero.
double start_turns_of(const TwinSetup& setup) {
  if (setup.locked) return 0.0;
  if (setup.start_turns) return *setup.start_turns;
  return board::initial_turns(setup.seed);
}

}  // namespace

TwinDrive::TwinDrive(const TwinSetup& setup)
    : setup_(setup),
      rig_({.drive = setup.drive,
            .seed = setup.seed,
            .locked = setup.locked,
            .start_turns = start_turns_of(setup),
            .encoders = setup.encoders,
            .three_phase = setup.three_phase,
            .motor = setup.motor}),
      own_flash_(setup.flash == nullptr ? std::make_unique<FlashFile>(setup.flash_file) : nullptr),
      store_(setup.flash == nullptr ? *own_flash_ : *setup.flash),
      own_pairing_(setup.pairing == nullptr ? std::make_unique<PairingFile>(pairing_file_of(setup.flash_file))
                                            : nullptr),
      pairing_(setup.pairing == nullptr ? *own_pairing_ : *setup.pairing) {
  board_.random = setup.seed;
  board_.hardware_stated = board::hardware_of(setup.drive, setup.encoders);
  if (rig_.three_phase() != nullptr) board_.stage = &rig_.three_phase()->stage();
  application_.begin(board_);
  const auto validate = [this](std::span<const std::uint8_t> block) { return blocks_.validate(block); };
  if (setup_.as_made && store_.boot(validate) == storage::StoreState::empty) {
    const std::vector<std::uint8_t> block = factory_block(setup_.drive);
    std::uint32_t reason = 0;
    if (store_.begin(block.size(), model::crc32(block)) != storage::StoreError::none ||
        store_.write(0, block) != storage::StoreError::none ||
        store_.commit(validate, reason) != storage::StoreError::none)
      throw std::runtime_error("the factory block cannot be stored; is the flash file writable?");
  }
  const auto info = firmware::DriveInfo::of({setup_.version.major, setup_.version.minor}, kBoardName, setup_.serial,
                                            protocol::FirmwareKey::development);
  service_ = std::make_unique<Service>(application_, store_, blocks_, board::SoftwareBoard::kTickHz, info, lock_);
  service_->start();
  application_.background();
}

void TwinDrive::tick() {
  board_.readings = &rig_.sense();
  board_.tripped = rig_.amplifier_tripped();
  board_.overrun = rig_.has(board::Injection::tick_overrun);
  application_.tick();
  rig_.act(board_.actuation);
  application_.background();
  service_->background();
}

}  // namespace flexspline::twin
