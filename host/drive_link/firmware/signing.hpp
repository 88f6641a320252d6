// Pairs of keys as files, and what they sign (Ed25519 of libsodium): firmware images, and the challenges of a drive
// that is paired. The drive's half is shared/boot/signature.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "host/drive_link/firmware/image_file.hpp"
#include "shared/boot/signature/ed25519.hpp"

namespace flexspline::firmware_files {

// The secret half is erased with the object.
class KeyPair {
 public:
  using Secret = std::array<std::uint8_t, ed25519::kKeyBytes>;

  explicit KeyPair(const Secret& secret);
  KeyPair(const KeyPair&) = default;
  KeyPair& operator=(const KeyPair&) = default;
  ~KeyPair();
  const ed25519::PublicKey& public_key() const { return public_key_; }
  bool is_development_key() const;

  ed25519::Signature signature_of(std::span<const std::uint8_t> message) const;
  // Signs an image that is whole: writes signature, counter and checksum into its header.
  void sign(Bytes& image, std::uint16_t security_counter) const;
  void save(const std::filesystem::path& path) const;

 private:
  Secret secret_;
  ed25519::PublicKey public_key_{};
};

KeyPair new_key_pair();
KeyPair development_key_pair();
// Throws ImageError where the file is not a key of ours, or others may read it.
KeyPair load_key_pair(const std::filesystem::path& path);

// 64 hexadecimal digits.
std::string text_of(const ed25519::PublicKey& key);

}  // namespace flexspline::firmware_files
