// All of the drive's code in one translation unit, for clang-tidy; never linked.
#include "firmware/application.hpp"
#include "firmware/parameter_lock.hpp"
#include "firmware/report_link.hpp"
#include "firmware/service.hpp"
#include "shared/boot/slots.hpp"
#include "shared/control/drive_block.hpp"
#include "shared/control/foc/current_limits.hpp"
#include "shared/control/foc/field_oriented.hpp"
#include "shared/effects/list.hpp"
#include "shared/model/block.hpp"
#include "shared/model/drive_model.hpp"
#include "shared/protocol/serial_frame.hpp"
#include "shared/storage/pairing_memory.hpp"
#include "shared/storage/parameter_store.hpp"
#include "shared/usb/device.hpp"
#include "shared/usb/hid.hpp"

namespace flexspline {

using Parameters = control::DriveParameters<fixed::Fixed>;
model::BlockVerdict check(std::span<const std::uint8_t> block) {
  return control::check_for_drive(block, 1000);
}

}  // namespace flexspline
