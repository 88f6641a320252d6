#include "hil/twin/twin_drive.hpp"

#include <algorithm>
#include <stdexcept>

#include "hil/board/drive_setup.hpp"
#include "hil/twin/factory_block.hpp"

namespace flexspline::twin {
namespace {

struct AnySection {
  model::BlockVerdict section(std::uint16_t, std::span<const std::uint8_t>) { return {}; }
};

template <std::size_t Size>
std::array<std::uint8_t, Size> text_in(const std::string& text) {
  std::array<std::uint8_t, Size> bytes{};
  std::copy_n(text.begin(), std::min(text.size(), Size - 1), bytes.begin());
  return bytes;
}

}  // namespace

std::uint32_t TwinBlocks::validate(std::span<const std::uint8_t> block) const {
  model::BlockHeader header;
  model::DriveModel<firmware::N, model::EveryFormula> model;
  AnySection others;
  const model::BlockVerdict verdict = model::load(block, header, model, others);
  if (!verdict.good()) return static_cast<std::uint32_t>(verdict.fault);
  try {
    board::parameters_of(drive_, board::read_packed_model(block));
  } catch (const std::runtime_error&) {
    return kDoesNotFit;
  }
  return 0;
}

void TwinBlocks::adopt(std::span<const std::uint8_t> block) {
  in_use_ = board::Block(board::parameters_of(drive_, board::read_packed_model(block)));
  application_.offer(in_use_.bytes());
}

std::optional<std::uint32_t> TwinBlocks::adopted() const {
  const auto finding = application_.block_finding();
  if (!finding) return {};
  return static_cast<std::uint32_t>(*finding);
}

TwinDrive::TwinDrive(const TwinSetup& setup)
    : setup_(setup),
      rig_({.drive = setup.drive, .seed = setup.seed, .locked = setup.locked}),
      flash_(setup.flash_file) {
  const auto validate = [this](std::span<const std::uint8_t> block) { return blocks_.validate(block); };
  if (setup_.as_made && store_.boot(validate) == storage::StoreState::empty) {
    const std::vector<std::uint8_t> block = factory_block(setup_.drive);
    std::uint32_t reason = 0;
    if (store_.begin(block.size(), model::crc32(block)) != storage::StoreError::none ||
        store_.write(0, block) != storage::StoreError::none ||
        store_.commit(validate, reason) != storage::StoreError::none)
      throw std::runtime_error("the block of the drive's maker cannot be stored; is the flash file writable?");
  }
  const firmware::DriveInfo info{{0, 1}, text_in<16>("twin"), text_in<16>(setup_.serial)};
  service_ = std::make_unique<Service>(application_, store_, blocks_, board::SoftwareBoard::kTickHz, info);
  service_->start();
  application_.background();
}

void TwinDrive::tick() {
  board_.readings = rig_.sense();
  board_.overrun = rig_.has(board::Injection::tick_overrun);
  application_.tick();
  rig_.act(board_.actuation);
  application_.background();
  service_->background();
}

}  // namespace flexspline::twin
