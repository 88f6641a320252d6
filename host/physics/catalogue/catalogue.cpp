#include "host/physics/catalogue/catalogue.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "host/physics/catalogue/coefficients.hpp"
#include "shared/effects/list.hpp"

namespace flexspline::catalogue {
namespace {

using effects::Inputs;
using effects::Torques;

template <class N>
typename N::Sum on_balance(const Torques<N>& torques, Balance balance) {
  switch (balance) {
    case Balance::motor:
      return torques.motor;
    case Balance::transmission:
      return torques.transmission;
    case Balance::load:
      return torques.load;
  }
  return torques.motor;
}

template <class E>
constexpr bool kAddsTorque = requires(typename E::template State<Real> state,
                                      typename E::template Coefficients<Real> coefficients, Inputs<Real> inputs,
                                      Torques<Real> torques) {
  E::evaluate(state, coefficients, inputs, torques);
};

template <class E, class N>
void torque_along(const typename N::Parameter* parameters, const DriveConstants<typename N::Parameter>& drive,
                  Balance balance, std::span<const Inputs<N>> inputs, typename N::Value* torque) {
  const auto coefficients = coefficients_of<E, N>(parameters, drive);
  typename E::template State<N> state{};
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    if (k > 0) E::advance(state, coefficients, inputs[k], inputs[k - 1]);
    Torques<N> sums{};
    E::evaluate(state, coefficients, inputs[k], sums);
    torque[k] += on_balance(sums, balance);
  }
}

template <class E, class N>
void torque_along_plain(const typename N::Parameter* parameters, const DriveConstants<typename N::Parameter>& drive,
                        Balance balance, const PlainInputs& inputs, typename N::Value* torque) {
  const auto coefficients = coefficients_of<E, N>(parameters, drive);
  typename E::template State<N> state{};
  Inputs<N> before;
  inputs.each_block([&](std::size_t first, std::span<const Inputs<Real>> block) {
    for (std::size_t k = 0; k < block.size(); ++k) {
      const Inputs<N> now = lifted<N>(block[k]);
      if constexpr (!std::is_empty_v<typename E::template State<N>>) {
        if (first + k > 0) E::advance(state, coefficients, now, before);
        before = now;
      }
      Torques<N> sums{};
      E::evaluate(state, coefficients, now, sums);
      torque[first + k] += on_balance(sums, balance);
    }
  });
}

template <class E, class N>
void change_along(const typename N::Parameter* parameters, const DriveConstants<typename N::Parameter>& drive,
                  std::span<Inputs<N>> inputs) {
  const auto coefficients = coefficients_of<E, N>(parameters, drive);
  for (Inputs<N>& in : inputs) {
    if constexpr (E::kInfo.phase == Phase::shift)
      E::shift(coefficients, in);
    else
      E::modulate(coefficients, in);
  }
}

template <class E>
class InstanceOf final : public Instance {
 public:
  InstanceOf(const double* parameters, const DriveConstants<double>& drive)
      : coefficients_(coefficients_of<E, Real>(parameters, drive)) {}

  void shift(Inputs<Real>& in) const override {
    if constexpr (E::kInfo.phase == Phase::shift) E::shift(coefficients_, in);
  }
  void modulate(Inputs<Real>& in) const override {
    if constexpr (E::kInfo.phase == Phase::modulate) E::modulate(coefficients_, in);
  }
  void evaluate(const Inputs<Real>& in, Torques<Real>& out) const override {
    if constexpr (kAddsTorque<E>) E::evaluate(state_, coefficients_, in, out);
  }
  void evaluate_ahead(const Inputs<Real>& now, const Inputs<Real>& before, Torques<Real>& out) const override {
    if constexpr (kAddsTorque<E>) {
      auto state = state_;
      E::advance(state, coefficients_, now, before);
      E::evaluate(state, coefficients_, now, out);
    }
  }
  void advance(const Inputs<Real>& now, const Inputs<Real>& before) override {
    if constexpr (kAddsTorque<E>) E::advance(state_, coefficients_, now, before);
  }

 private:
  typename E::template Coefficients<Real> coefficients_;
  typename E::template State<Real> state_{};
};

template <class E, class N>
BlockFunctions<N> along() {
  BlockFunctions<N> functions;
  if constexpr (kAddsTorque<E>) {
    functions.torque = &torque_along<E, N>;
    functions.torque_of_plain = &torque_along_plain<E, N>;
  }
  if constexpr (E::kInfo.phase != Phase::source) functions.change = &change_along<E, N>;
  return functions;
}

std::vector<Entry> make_entries(bool is_user_defined) {
  std::vector<Entry> entries;
  effects::for_each_effect([&]<class E>(std::size_t id) {
    if (E::kInfo.user_defined != is_user_defined) return;
    Entry entry;
    entry.id = id;
    entry.info = &E::kInfo;
    entry.parameters = E::kParameters;
    entry.has_state = !std::is_empty_v<typename E::template State<Real>>;
    entry.real = along<E, Real>();
    entry.dual = along<E, Dual>();
    entry.make = [](const double* parameters, const DriveConstants<double>& drive) -> std::unique_ptr<Instance> {
      return std::make_unique<InstanceOf<E>>(parameters, drive);
    };
    entries.push_back(entry);
  });
  return entries;
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> table = make_entries(false);
  return table;
}

}  // namespace

std::string balance_name(Balance balance) {
  switch (balance) {
    case Balance::motor:
      return "motor";
    case Balance::transmission:
      return "transmission";
    case Balance::load:
      return "load";
  }
  return {};
}

std::size_t Entry::index_of(std::string_view parameter) const {
  const auto at =
      std::find_if(parameters.begin(), parameters.end(), [&](const auto& p) { return p.name == parameter; });
  return static_cast<std::size_t>(at - parameters.begin());
}

std::size_t Entry::count(Kind kind) const {
  return static_cast<std::size_t>(
      std::count_if(parameters.begin(), parameters.end(), [&](const auto& p) { return p.kind == kind; }));
}

template <class P>
std::vector<P> natural(const Entry& entry, const std::vector<P>& reduced) {
  using std::pow;
  std::vector<P> values = reduced;
  // What is stated per another comes after it: first roots, then ratios to what is neither.
  for (std::size_t p = 0; p < values.size(); ++p)
    if (const auto root = entry.parameters[p].root_of; !root.empty())
      values[p] = pow(reduced[p], reduced[entry.index_of(root)]);
  for (std::size_t p = 0; p < values.size(); ++p)
    if (const auto per = entry.parameters[p].per; !per.empty()) values[p] = values[p] * values[entry.index_of(per)];
  return values;
}
template std::vector<double> natural(const Entry&, const std::vector<double>&);
template std::vector<numbers::Jet> natural(const Entry&, const std::vector<numbers::Jet>&);

std::vector<double> reduced(const Entry& entry, const std::vector<double>& natural) {
  std::vector<double> values = natural;
  for (std::size_t p = 0; p < values.size(); ++p)
    if (const auto per = entry.parameters[p].per; !per.empty()) {
      const double unit = natural[entry.index_of(per)];
      values[p] = unit != 0.0 ? natural[p] / unit : 0.0;
    }
  for (std::size_t p = 0; p < values.size(); ++p)
    if (const auto root = entry.parameters[p].root_of; !root.empty())
      values[p] = std::pow(std::max(values[p], 0.0), 1.0 / natural[entry.index_of(root)]);
  return values;
}

std::span<const Entry> all() {
  return entries();
}

const Entry* find(std::string_view name) {
  for (const Entry& entry : entries())
    if (entry.name() == name) return &entry;
  return nullptr;
}

const Entry* find_user_defined(std::string_view name) {
  static const std::vector<Entry> table = make_entries(true);
  for (const Entry& entry : table)
    if (entry.name() == name) return &entry;
  return nullptr;
}

const Entry& get(std::string_view name) {
  if (const Entry* entry = find(name)) return *entry;
  throw std::out_of_range("no effect named " + std::string(name));
}

std::vector<std::string_view> confused_with(const Entry& entry) {
  std::vector<std::string_view> names = split_names(entry.info->confused_with);
  for (const Entry& other : all())
    if (names_contain(other.info->confused_with, entry.name()) &&
        std::find(names.begin(), names.end(), other.name()) == names.end())
      names.push_back(other.name());
  return names;
}

std::vector<std::string_view> split_names(std::string_view names) {
  std::vector<std::string_view> parts;
  while (!names.empty()) {
    const std::size_t comma = names.find(',');
    parts.push_back(names.substr(0, comma));
    names = comma == std::string_view::npos ? std::string_view{} : names.substr(comma + 1);
  }
  return parts;
}

bool names_contain(std::string_view names, std::string_view name) {
  const auto parts = split_names(names);
  return std::find(parts.begin(), parts.end(), name) != parts.end();
}

}  // namespace flexspline::catalogue
