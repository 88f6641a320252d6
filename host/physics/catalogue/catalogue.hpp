// The effects of shared/effects as data: what the host does with an effect whose name it learns at run time.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host/common/numbers/dual.hpp"
#include "host/common/numbers/real.hpp"
#include "shared/effects/effect.hpp"

namespace flexspline::model {
struct Definition;
}

namespace flexspline::catalogue {

using effects::Balance;

using effects::DriveConstants;
using effects::Kind;
using effects::Phase;
using numbers::Dual;
using numbers::Real;

// "motor", "transmission" or "load", as model files and answers have it.
std::string balance_name(Balance balance);

// An effect at work in a simulation: coefficients and inner state.
class Instance {
 public:
  virtual ~Instance() = default;
  virtual void shift(effects::Inputs<Real>&) const {}
  virtual void modulate(effects::Inputs<Real>&) const {}
  // Adds the effect's torques for these inputs, with its present state.
  virtual void evaluate(const effects::Inputs<Real>&, effects::Torques<Real>&) const {}
  // The same with the state moved on from `before` to `now`, and left as it was.
  virtual void evaluate_ahead(const effects::Inputs<Real>& now, const effects::Inputs<Real>& before,
                              effects::Torques<Real>&) const = 0;
  virtual void advance(const effects::Inputs<Real>& now, const effects::Inputs<Real>& before) = 0;
};

// Plain inputs of a record, given a block at a time: a record keeps its signals in a form of its own.
class PlainInputs {
 public:
  using Inputs = effects::Inputs<Real>;
  static constexpr std::size_t kBlock = 256;  // what stays in the processor's cache
  // Writes the inputs from `first` on, at least the signals that `reads` (bits of effects::Signals) names.
  using Copy = void (*)(const void* record, std::size_t first, std::span<Inputs> to, unsigned reads);

  PlainInputs(const Inputs* inputs, std::size_t count) : inputs_(inputs), size_(count) {}
  PlainInputs(std::span<const Inputs> inputs) : PlainInputs(inputs.data(), inputs.size()) {}
  PlainInputs(const std::vector<Inputs>& inputs) : PlainInputs(inputs.data(), inputs.size()) {}
  PlainInputs(const void* record, std::size_t size, unsigned reads, Copy copy)
      : record_(record), size_(size), reads_(reads), copy_(copy) {}

  std::size_t size() const { return size_; }
  // Calls work(first, inputs) for one block after the other.
  template <class Work>
  void each_block(Work work) const {
    if (!copy_) {
      work(std::size_t{0}, std::span<const Inputs>(inputs_, size_));
      return;
    }
    std::vector<Inputs> block(std::min(kBlock, size_));
    for (std::size_t first = 0; first < size_; first += kBlock) {
      const std::span<Inputs> part = std::span(block).first(std::min(kBlock, size_ - first));
      copy_(record_, first, part, reads_);
      work(first, std::span<const Inputs>(part));
    }
  }

 private:
  const Inputs* inputs_ = nullptr;
  const void* record_ = nullptr;
  std::size_t size_ = 0;
  unsigned reads_ = 0;
  Copy copy_ = nullptr;
};

// What can be done with an effect along a whole record in number system N. `parameters` are in the order of the
// catalogue; inner states start from rest at each call.
template <class N>
struct BlockFunctions {
  using Parameter = typename N::Parameter;
  // Adds the effect's torque on `balance` at each sample of `inputs` to `torque` (N m), same length. Null where it adds
  // to none, as most shifts and all modulations.
  std::function<void(const Parameter* parameters, const DriveConstants<Parameter>& drive, Balance balance,
                     std::span<const effects::Inputs<N>> inputs, typename N::Value* torque)>
      torque;
  // The same along plain inputs.
  std::function<void(const Parameter* parameters, const DriveConstants<Parameter>& drive, Balance balance,
                     const PlainInputs& inputs, typename N::Value* torque)>
      torque_of_plain;
  // Changes the inputs in place, as shifts and modulations do. Null for sources.
  std::function<void(const Parameter* parameters, const DriveConstants<Parameter>& drive,
                     std::span<effects::Inputs<N>> inputs)>
      change;
};

struct Entry {
  std::size_t id = 0;
  const effects::Description* info = nullptr;
  std::span<const effects::ParameterInfo> parameters;
  bool has_state = false;
  BlockFunctions<Real> real;
  BlockFunctions<Dual> dual;
  std::function<std::unique_ptr<Instance>(const double* parameters, const DriveConstants<double>& drive)> make;
  // The definition of a user-defined effect in its model file; else null.
  const model::Definition* definition = nullptr;
  std::string label{};  // "table_effect:velocity"
  // A law of presliding: it has a memory, replaces a law of the velocity alone, and differs from that around reversals.
  bool is_presliding() const { return has_state && info->balance == Balance::motor && !info->replaces.empty(); }

  std::string_view name() const { return info->name; }
  // Position of a parameter, or parameters.size() if there is none of that name.
  std::size_t index_of(std::string_view parameter) const;
  std::size_t count(Kind kind) const;
  bool adds_torque() const { return static_cast<bool>(real.torque); }
  bool adds_to(Balance balance) const { return info->balance == balance || (info->adds_to & on(balance)) != 0; }
  // The balance on which its parameters are estimated.
  Balance identified_on() const { return info->identified_on_motor ? Balance::motor : info->balance; }
};

// Parameters as they are searched for (see effects::ParameterInfo), and back. Where a parameter that another is stated
// per is zero, so is the reduced one.
template <class P>
std::vector<P> natural(const Entry& entry, const std::vector<P>& reduced);
std::vector<double> reduced(const Entry& entry, const std::vector<double>& natural);

// Inputs in number system N from plain ones.
template <class N>
effects::Inputs<N> lifted(const effects::Inputs<Real>& in) {
  if constexpr (std::is_same_v<N, Real>) {
    return in;
  } else {
    using S = typename N::Value;
    return {S(in.angle),           S(in.velocity),         S(in.speed),
            S(in.direction),       S(in.acceleration),     S(in.output_angle),
            S(in.output_velocity), S(in.output_direction), S(in.output_acceleration),
            S(in.torsion),         S(in.torsion_rate),     S(in.torsion_direction),
            S(in.torque),          S(in.torque_magnitude), S(in.current),
            S(in.temperature),     S(in.viscous_scale),    S(in.coulomb_scale),
            S(in.elapsed)};
  }
}

// All effects, by rising number, except user-defined ones: see user_defined_effect.hpp.
std::span<const Entry> all();
// What users make effects of: an entry that takes all that is stated as parameters. Null if there is none of that name.
const Entry* find_user_defined(std::string_view name);
// Null if there is none of that name.
const Entry* find(std::string_view name);
// As `find`, for names that are known to exist; throws std::out_of_range.
const Entry& get(std::string_view name);

// The effects that it names as confused with it, and those that name it: each header states the relation for itself.
std::vector<std::string_view> confused_with(const Entry& entry);

// "a,b" to {"a", "b"}.
std::vector<std::string_view> split_names(std::string_view names);
bool names_contain(std::string_view names, std::string_view name);

}  // namespace flexspline::catalogue
