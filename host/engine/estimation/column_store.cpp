#include "host/engine/estimation/column_store.hpp"

#include <functional>

namespace flexspline::estimation {
namespace {

ColumnKey::EffectAt effect_at(const Term& term) {
  ColumnKey::EffectAt at{term.entry->id, {}};
  for (std::size_t p = 0; p < term.values.size(); ++p)
    if (term.entry->parameters[p].kind != effects::Kind::linear) at.values.push_back(term.values[p]);
  return at;
}

}  // namespace

ColumnKey key_of(const Terms& terms, std::size_t term, ColumnKey::What what, std::size_t linear,
                 std::size_t nonlinear) {
  ColumnKey key{what, linear, nonlinear, {effect_at(terms[term])}};
  for (const Term& other : terms)
    if (changes_inputs_of(other, terms[term])) key.effects.push_back(effect_at(other));
  return key;
}

std::size_t ColumnStore::Hash::operator()(const ColumnKey& key) const {
  std::size_t hash = 0;
  // As boost::hash_combine: the golden ratio spreads the bits.
  const auto add = [&](std::size_t value) { hash ^= value + 0x9e3779b97f4a7c15U + (hash << 6U) + (hash >> 2U); };
  add(static_cast<std::size_t>(key.what));
  add(key.linear);
  add(key.nonlinear);
  for (const ColumnKey::EffectAt& e : key.effects) {
    add(e.effect);
    for (const double value : e.values) add(std::hash<double>{}(value));
  }
  return hash;
}

ColumnStore::Column ColumnStore::find(const ColumnKey& key) {
  const std::lock_guard lock(mutex_);
  const auto found = columns_.find(key);
  if (found == columns_.end()) return nullptr;
  uses_.splice(uses_.begin(), uses_, found->second.use);
  return found->second.column;
}

ColumnStore::Column ColumnStore::insert(const ColumnKey& key, Eigen::VectorXd column) {
  auto made = std::make_shared<const Eigen::VectorXd>(std::move(column));
  const std::lock_guard lock(mutex_);
  const auto [at, is_new] = columns_.try_emplace(key);
  if (!is_new) return at->second.column;
  uses_.push_front(&at->first);
  at->second = {made, uses_.begin()};
  numbers_ += static_cast<std::size_t>(made->size());
  while (numbers_ > most_numbers_ && uses_.size() > 1) {
    const auto oldest = columns_.find(*uses_.back());
    numbers_ -= static_cast<std::size_t>(oldest->second.column->size());
    uses_.pop_back();
    columns_.erase(oldest);
  }
  return made;
}

}  // namespace flexspline::estimation
