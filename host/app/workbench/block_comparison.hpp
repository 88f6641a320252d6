// Blocks of a drive, and what one changes against another, as JSON for the page.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "host/drive_link/drive/block_changes.hpp"

namespace flexspline::workbench {

// The blocks that a preview of flashing compared.
struct ComparedBlocks {
  drive::Bytes active, made;
};

// {"model", "bytes", "sha256"}, null where there is none.
nlohmann::json view_json(const drive::BlockView& view);
// {"before", "after", "changes"}.
nlohmann::json comparison_json(const drive::Bytes& before, const drive::Bytes& after);

}  // namespace flexspline::workbench
