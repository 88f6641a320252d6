// Filtered columns of one balance, shared by all fits and threads: each is computed once, and never changes.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "host/engine/estimation/terms.hpp"

namespace flexspline::estimation {

// What a column is, and every value that it depends on, exactly.
struct ColumnKey {
  enum class What {
    unit,    // torque of one unit of a linear parameter
    slope,   // of that by a nonlinear parameter
    torque,  // of a term that no linear parameter scales
  };
  // An effect at its nonlinear and given values; linear values are no part of it.
  struct EffectAt {
    std::size_t effect = 0;  // catalogue::Entry::id
    std::vector<double> values;
    bool operator==(const EffectAt&) const = default;
  };
  What what = What::unit;
  std::size_t linear = 0;         // parameter that is one
  std::size_t nonlinear = 0;      // of the slope
  std::vector<EffectAt> effects;  // the term's, and behind it those that change its inputs, in the order of the model

  bool operator==(const ColumnKey&) const = default;
};

// Of a term with the shifts and modulations of the model that reach it.
ColumnKey key_of(const Terms& terms, std::size_t term, ColumnKey::What what, std::size_t linear = 0,
                 std::size_t nonlinear = 0);

// May be used from several threads at once. Columns that were not used for the longest time go where the numbers
// together are more than `most_numbers`; whoever holds one keeps it.
class ColumnStore {
 public:
  using Column = std::shared_ptr<const Eigen::VectorXd>;

  explicit ColumnStore(std::size_t most_numbers) : most_numbers_(most_numbers) {}

  // Null where it is not there.
  Column find(const ColumnKey& key);
  // What is there already stays and is returned.
  Column insert(const ColumnKey& key, Eigen::VectorXd column);

 private:
  struct Hash {
    std::size_t operator()(const ColumnKey& key) const;
  };
  struct Stored {
    Column column;
    std::list<const ColumnKey*>::iterator use;
  };

  const std::size_t most_numbers_;
  std::mutex mutex_;
  std::size_t numbers_ = 0;
  std::unordered_map<ColumnKey, Stored, Hash> columns_;
  std::list<const ColumnKey*> uses_;  // the last one first
};

}  // namespace flexspline::estimation
