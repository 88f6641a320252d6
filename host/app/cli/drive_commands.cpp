#include "host/app/cli/drive_commands.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>

#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/firmware/signing.hpp"
#include "shared/model/block.hpp"

namespace flexspline::cli {
namespace {

volatile std::sig_atomic_t was_interrupted = 0;
void note_signal(int) {
  was_interrupted = 1;
}

}  // namespace

drive::Session open_drive(const std::string& drive) {
  return drive::Session(transport::open_link(drive));
}

std::optional<drive::PairingSigner> pairing_signer(const std::filesystem::path& file) {
  if (file.empty()) return {};
  const firmware_files::KeyPair key = firmware_files::load_key_pair(file);
  return drive::PairingSigner{file.string(), key.public_key(),
                              [key](std::span<const std::uint8_t> message) { return key.signature_of(message); }};
}

std::string named(const drive::Session& session) {
  return fmt::format("drive {} ({}) at {}", session.serial(), session.board(), session.name());
}

bool confirmed(const std::string& question, bool yes) {
  if (yes || isatty(STDIN_FILENO) == 0 || isatty(STDERR_FILENO) == 0) return true;
  fmt::print(stderr, "{} [y/N] ", question);
  std::fflush(stderr);
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

drive::Bytes read_block_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw UsageError(fmt::format("{} cannot be read; is the path right?", path.string()));
  // One byte more than the largest block shows that a file is too large.
  drive::Bytes bytes(model::kLargestBlock + 1);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  try {
    deployment::unpack(bytes);
  } catch (const deployment::PackError& error) {
    throw deployment::PackError(fmt::format("{}: {}", path.string(), error.what()));
  }
  return bytes;
}

Interruptible::Interruptible() {
  was_interrupted = 0;
  std::signal(SIGINT, note_signal);
  std::signal(SIGTERM, note_signal);
}
Interruptible::~Interruptible() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}
bool Interruptible::interrupted() {
  return was_interrupted != 0;
}

}  // namespace flexspline::cli
