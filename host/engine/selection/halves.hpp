// Sums of blocks: halves of the data, and records weighted by what the model leaves in them.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "host/engine/selection/friction_random_effects.hpp"

namespace flexspline::selection {

// Weights of the records: one over the variance that the model leaves in each, none more than ten times the median.
// Zero for a record without samples.
std::vector<double> record_weights(const RegressorTable& table, const Setting& setting);

// Products of all blocks; each record's differences eliminated. Those of the state of presliding where it competes.
HalfData sum_of(const Setting& setting, const std::vector<double>& weights, const FrictionRandomEffects& differences);

// Of each choice `in` of blocks: the half with in[k] != 0, and the other half.
using HalfPair = std::array<HalfData, 2>;
std::vector<HalfPair> halves_of(const Setting& setting, const std::vector<double>& weights,
                                std::span<const std::vector<std::uint8_t>> in,
                                const FrictionRandomEffects& differences);

// Which blocks are in the first of two complementary halves: half of each record's blocks, so that no half lacks a
// record.
std::vector<std::uint8_t> half_of_blocks(const Setting& setting, std::mt19937_64& chance);
// The same of whole records.
std::vector<std::uint8_t> half_of_records(const Setting& setting, std::mt19937_64& chance);

}  // namespace flexspline::selection
