// From a model to a parameter block for a drive, with the proof that it is safe and how far it is from double; and
// back.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/drive_link/deployment/drive_settings.hpp"
#include "host/physics/model/model.hpp"
#include "shared/control/hardware.hpp"
#include "shared/model/block.hpp"

namespace flexspline::deployment {

// A model that does not fit a drive, or a block that is none: what is wrong and what to do. Exit 2.
class PackError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Everything fits, but the error is above the bound, or has none that can be proven. Exit 1.
class BoundError : public PackError {
 public:
  using PackError::PackError;
};
class UnprovenError : public BoundError {
 public:
  using BoundError::BoundError;
};

struct PackOptions {
  double tick_hz = 16000.0;
  double bound = 1e-6;  // of the error, as a share of rated torque
  std::string drive;    // identity; empty: any
  // Settings of the drive (drive_settings.hpp): then the block has all that a drive needs. Text and where it is from.
  std::optional<std::string> settings;
  std::string settings_origin = "settings";
  control::Hardware hardware;            // what the drive's board states: taken for what the settings leave out
  std::optional<double> encoder_counts;  // per motor turn: then the block has an encoder filter
  double filter_corner_hz = 50.0;
  std::vector<std::string> image;  // effects that the firmware has; empty: all that a drive can run
  std::size_t samples = 100'000;
  std::uint64_t seed = 1;
  bool measured = false;  // the error along the samples is enough where it cannot be proven
};

// A bound that holds for every input within the envelope, and how it was found: "interval" (of an effect without
// memory), "invariant" (of one with: its states cannot grow beyond), "impulse_response" (of a linear observer), "range"
// (of the sum on a balance), "error" (how far it is from the equations at most: PROOF.md), "interpolation" (of a table
// that an effect was folded into, measured between its points), "measured_error" (largest difference to double along
// the samples, with the interpolation).
struct ProofPart {
  std::string part;
  std::string kind;
  double bound = 0.0;  // of an error that is not proven infinite
  std::string unit;
  // Of an error: its share of rated torque on the balance where that is the largest, the largest along the samples, and
  // why it is not proven; empty where it is.
  std::optional<double> share_of_rated{};
  std::optional<double> observed{};
  std::string unproven{};
};

struct Packed {
  std::vector<std::uint8_t> bytes;
  std::string sha256;
  double max_error_nm = 0.0;  // on the balance where it is the largest share
  double max_error_share_of_rated = 0.0;
  std::string worst_balance;
  bool error_is_proven = false;
  double error_bound_share_of_rated = 0.0;  // proven; infinite where it is not
  double torque_scale = 1.0;                // by which the bases of torque were widened
  std::vector<ProofPart> proof;
};

// Throws PackError where the model lacks values, an effect does not fit or is not in the image, the proof fails or the
// error exceeds the bound.
Packed pack(const model::Model& model, const PackOptions& options = {});

// A coefficient as it is stored in a block.
struct Coefficient {
  std::string kind;  // "gain", "value", ...
  double value = 0.0;
};
struct UnpackedEffect {
  std::string type;
  std::vector<Coefficient> coefficients;
};
struct Unpacked {
  model::BlockHeader header;
  std::vector<UnpackedEffect> effects;
  std::vector<std::uint16_t> sections;
  // Of the drive's settings, in SI; empty where the block has none, and then `refusal` gives the drive's reason.
  std::vector<NamedQuantity> settings;
  std::string refusal;
  std::optional<model::Model> model;  // from the note that the host leaves in a block
  bool coefficients_follow = false;   // from the parameters of that model, to the bit
};
// Throws PackError with the reason where the bytes are no good block.
Unpacked unpack(std::span<const std::uint8_t> block);

}  // namespace flexspline::deployment
