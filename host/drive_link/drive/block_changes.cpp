#include "host/drive_link/drive/block_changes.hpp"

#include <algorithm>
#include <map>

#include "host/drive_link/deployment/pack.hpp"
#include "host/drive_link/deployment/sha256.hpp"
#include "host/drive_link/drive/scales.hpp"

namespace flexspline::drive {
namespace {

struct Value {
  double value = 0.0;
  std::string unit;
};
// An effect's parameters by name; of a block without them, its coefficients by their place.
struct Content {
  std::map<std::string, Value> values;
  bool are_parameters = false;
};
using Contents = std::vector<std::pair<std::string, Content>>;

Contents contents_of(const deployment::Unpacked& block) {
  Contents all;
  if (block.model) {
    for (const model::Effect& effect : block.model->effects) {
      Content content{{}, true};
      for (const model::Parameter& p : effect.parameters)
        if (p.value) content.values[p.name] = {*p.value, p.unit};
      all.emplace_back(effect.id, std::move(content));
    }
    return all;
  }
  std::map<std::string, int> seen;
  for (const deployment::UnpackedEffect& effect : block.effects) {
    Content content;
    for (std::size_t i = 0; i < effect.coefficients.size(); ++i)
      content.values[std::to_string(i)] = {effect.coefficients[i].value, {}};
    const int nth = ++seen[effect.type];
    all.emplace_back(nth == 1 ? effect.type : effect.type + "#" + std::to_string(nth), std::move(content));
  }
  return all;
}
// Without the parameters: the only way to compare with a block that came without them.
Contents coefficients_of(deployment::Unpacked block) {
  block.model.reset();
  return contents_of(block);
}
const Content* find(const Contents& all, const std::string& id) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& one) { return one.first == id; });
  return found == all.end() ? nullptr : &found->second;
}

void compare(const std::string& id, const Content& old, const Content& now, std::vector<BlockChange>& out) {
  bool same = old.values.size() == now.values.size();
  for (const auto& [name, value] : now.values) {
    const auto before = old.values.find(name);
    if (before != old.values.end() && before->second.value == value.value) continue;
    same = false;
    if (!now.are_parameters) continue;
    BlockChange change{id, "changed", name, {}, value.value, value.unit};
    if (before != old.values.end()) change.before = before->second.value;
    out.push_back(std::move(change));
  }
  if (same) out.push_back({id, "same", {}});
  if (!same && !now.are_parameters) out.push_back({id, "changed", {}});
}

}  // namespace

BlockView view_of(const Bytes& block) {
  if (block.empty()) return {};
  BlockView view{block.size(), deployment::sha256(block), {}, {}};
  if (const auto scales = scales_of(block)) {
    view.model = text_of(scales->header.model);
    view.drive = text_of(scales->header.drive);
  }
  return view;
}

std::vector<BlockChange> changes(const Bytes& before, const Bytes& after) {
  const deployment::Unpacked now = deployment::unpack(after);
  std::optional<deployment::Unpacked> old;
  try {
    if (!before.empty()) old = deployment::unpack(before);
  } catch (const deployment::PackError&) {
    // A block that this tool cannot read: everything counts as new.
  }
  const bool by_parameters = now.model && old && old->model;
  const Contents old_contents = !old ? Contents{} : by_parameters ? contents_of(*old) : coefficients_of(*old);
  const Contents now_contents = by_parameters || !old ? contents_of(now) : coefficients_of(now);
  std::vector<BlockChange> out;
  for (const auto& [id, content] : now_contents) {
    if (const Content* was = find(old_contents, id)) {
      compare(id, *was, content, out);
    } else {
      out.push_back({id, "added", {}});
    }
  }
  for (const auto& [id, content] : old_contents)
    if (find(now_contents, id) == nullptr) out.push_back({id, "removed", {}});
  return out;
}

}  // namespace flexspline::drive
