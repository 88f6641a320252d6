#include "host/app/workbench/block_comparison.hpp"

#include <nlohmann/json.hpp>

#include "host/output/answers/json.hpp"

namespace flexspline::workbench {

using nlohmann::json;

json view_json(const drive::BlockView& view) {
  if (view.bytes == 0) return nullptr;
  return {{"model", view.model}, {"bytes", view.bytes}, {"sha256", view.sha256}};
}

namespace {

json changes_json(const std::vector<drive::BlockChange>& changes) {
  json list = json::array();
  for (const drive::BlockChange& c : changes)
    list.push_back({{"effect", c.effect},
                    {"change", c.what},
                    {"parameter", c.parameter},
                    {"before", output::json_number(c.before)},
                    {"after", output::json_number(c.after)},
                    {"unit", c.unit}});
  return list;
}

}  // namespace

json comparison_json(const drive::Bytes& before, const drive::Bytes& after) {
  return {{"before", view_json(drive::view_of(before))},
          {"after", view_json(drive::view_of(after))},
          {"changes", changes_json(drive::changes(before, after))}};
}

}  // namespace flexspline::workbench
