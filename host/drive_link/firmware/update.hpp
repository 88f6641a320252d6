// A firmware update from beginning to end: which drive, whether the image is for it, boot loader, download, and whether
// the new firmware runs afterwards.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "host/drive_link/firmware/image_file.hpp"

namespace flexspline::firmware_files {

// A drive, or its boot loader, as it is before the update.
struct Target {
  std::string serial;
  std::string board;
  bool is_loader = false;
  std::optional<boot::Version> version;  // none: a boot loader that has no image to run, or does not upload
};

// What --drive names, empty: the only one on USB. Throws DfuError, LinkError or DriveError where there is none, more
// than one, or it does not answer.
Target find_target(const std::string& drive);

// Throws ImageError where the image is for another board, or is older and `allow_older` is not given. Before anything
// is sent.
void require_fit(const Image& image, const Target& target, bool allow_older);

// The version that runs after the trial of a new image, which a drive may end by going back to the one before: `look`
// waits for the drive's answer (none where it does not come back), `wait` lasts longer than a trial.
std::optional<boot::Version> version_after_trial(const std::function<std::optional<boot::Version>()>& look,
                                                 const std::function<void()>& wait);

// Brings the drive into its boot loader, sends the image and waits until the drive is back and its trial over. Returns
// the version that runs then: another one than the image's where the drive took it back. progress(what is being done).
// Throws DfuError with where it stopped, and what to do.
boot::Version update(const Image& image, const Target& target, const std::function<void(const std::string&)>& progress);

}  // namespace flexspline::firmware_files
