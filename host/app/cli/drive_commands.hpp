// What the commands that speak with a drive have in common.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "host/app/cli/inputs.hpp"
#include "host/drive_link/drive/pairing.hpp"
#include "host/drive_link/drive/session.hpp"

namespace flexspline::cli {

// Opens what --drive names and identifies it.
drive::Session open_drive(const std::string& drive);
// The key of --pairing-key; none for an empty path. Throws as firmware_files::load_key_pair does.
std::optional<drive::PairingSigner> pairing_signer(const std::filesystem::path& file);
// "drive SERIAL (BOARD) at NAME".
std::string named(const drive::Session& session);
// Asks on a terminal, unless `yes`; without a terminal there is no question and the result is true.
bool confirmed(const std::string& question, bool yes);
// A good parameter block from a file. Throws UsageError where it cannot be read, deployment::PackError with the file
// and the place where the block is bad.
drive::Bytes read_block_file(const std::filesystem::path& path);

// True once Ctrl-C was pressed (or the process received SIGTERM) while one of these exists.
class Interruptible {
 public:
  Interruptible();
  ~Interruptible();
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;
  static bool interrupted();
};

}  // namespace flexspline::cli
