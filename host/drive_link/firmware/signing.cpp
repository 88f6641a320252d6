#include "host/drive_link/firmware/signing.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <vector>

#include "shared/boot/development_key.hpp"

namespace flexspline::firmware_files {
namespace {

using nlohmann::json;

constexpr const char* kKeyFormat = "flexspline-signing-key/1";

void start_library() {
  if (sodium_init() < 0) throw ImageError("libsodium does not start: the system gives no random numbers");
}

std::string hex_of(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}
std::optional<std::array<std::uint8_t, 32>> bytes_of_hex(const std::string& text) {
  std::array<std::uint8_t, 32> bytes{};
  if (text.size() != 2 * bytes.size()) return {};
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t digit = std::string_view("0123456789abcdef").find(text[i]);
    if (digit == std::string_view::npos) return {};
    bytes[i / 2] = static_cast<std::uint8_t>(bytes[i / 2] << 4 | digit);
  }
  return bytes;
}

class File {
 public:
  explicit File(int number) : number_(number) {}
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  ~File() {
    if (number_ >= 0) close(number_);
  }
  int number() const { return number_; }

 private:
  int number_;
};

}  // namespace

KeyPair::KeyPair(const Secret& secret) : secret_(secret) {
  start_library();
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> both{};
  crypto_sign_seed_keypair(public_key_.data(), both.data(), secret_.data());
  sodium_memzero(both.data(), both.size());
}

KeyPair::~KeyPair() {
  sodium_memzero(secret_.data(), secret_.size());
}

bool KeyPair::is_development_key() const {
  return public_key_ == boot::kDevelopmentKey;
}

ed25519::Signature KeyPair::signature_of(std::span<const std::uint8_t> message) const {
  std::array<std::uint8_t, crypto_sign_SECRETKEYBYTES> both{};
  ed25519::PublicKey same{};
  ed25519::Signature signature{};
  crypto_sign_seed_keypair(same.data(), both.data(), secret_.data());
  crypto_sign_detached(signature.data(), nullptr, message.data(), message.size(), both.data());
  sodium_memzero(both.data(), both.size());
  return signature;
}

void KeyPair::sign(Bytes& image, std::uint16_t security_counter) const {
  boot::ImageHeader header;
  if (boot::read_image(image, header) != boot::ImageFinding::none || header.whole_bytes() != image.size())
    throw ImageError("what is to be signed is not one whole image");
  header.signature_kind = boot::SignatureKind::ed25519;
  header.signature = {};
  header.security_counter = security_counter;
  const auto room = std::span(image).first<boot::kHeaderBytes>();
  boot::write_header(room, header);
  std::vector<std::uint8_t> message;
  boot::each_signed_part(
      image, [&](std::span<const std::uint8_t> part) { message.insert(message.end(), part.begin(), part.end()); });
  header.signature = signature_of(message);
  boot::write_header(room, header);
}

void KeyPair::save(const std::filesystem::path& path) const {
  // O_EXCL: a key that is overwritten is lost, and with it the drives that take its images only.
  const File file(open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR));
  if (file.number() < 0 && errno == EEXIST)
    throw ImageError(fmt::format("{} is there already; a key is never overwritten, name another file", path.string()));
  if (file.number() < 0)
    throw ImageError(fmt::format("{} cannot be written: {}; is the path right?", path.string(), std::strerror(errno)));
  std::string text =
      json{{"format", kKeyFormat}, {"public", hex_of(public_key_)}, {"secret", hex_of(secret_)}}.dump(1) + "\n";
  const bool written =
      write(file.number(), text.data(), text.size()) == static_cast<ssize_t>(text.size()) && fsync(file.number()) == 0;
  sodium_memzero(text.data(), text.size());
  if (!written) {
    unlink(path.c_str());
    throw ImageError(fmt::format("{} could not be written; make room on the disk", path.string()));
  }
}

KeyPair new_key_pair() {
  start_library();
  KeyPair::Secret secret{};
  randombytes_buf(secret.data(), secret.size());
  const KeyPair pair(secret);
  sodium_memzero(secret.data(), secret.size());
  return pair;
}

KeyPair development_key_pair() {
  KeyPair::Secret secret{};
  std::copy(boot::kDevelopmentSecret.begin(), boot::kDevelopmentSecret.end(), secret.begin());
  return KeyPair(secret);
}

KeyPair load_key_pair(const std::filesystem::path& path) {
  struct stat info {};
  std::ifstream in(path);
  if (!in || stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode))
    throw ImageError(fmt::format("{} cannot be read; is the path right?", path.string()));
  if ((info.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw ImageError(fmt::format("{}: others may read the secret key (mode {:04o}); chmod 600 {}", path.string(),
                                 info.st_mode & 07777, path.string()));
  const json file = json::parse(in, nullptr, false);
  const auto text_at = [&](const char* name) {
    return file.is_object() && file.contains(name) && file[name].is_string() ? file[name].get<std::string>()
                                                                             : std::string();
  };
  if (text_at("format") != kKeyFormat)
    throw ImageError(fmt::format("{} is not a file of keys; flexspline key --new makes one", path.string()));
  const auto secret = bytes_of_hex(text_at("secret"));
  if (!secret) throw ImageError(fmt::format("{}: its secret key is not 64 hexadecimal digits", path.string()));
  const KeyPair pair(*secret);
  if (hex_of(pair.public_key()) != text_at("public"))
    throw ImageError(fmt::format("{} is damaged: its public key does not belong to its secret one", path.string()));
  return pair;
}

std::string text_of(const ed25519::PublicKey& key) {
  return hex_of(key);
}

}  // namespace flexspline::firmware_files
