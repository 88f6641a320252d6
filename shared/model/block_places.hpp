// Where the effects of an image are in its model and what their rows in a block are: tables, made by the compiler from
// the effects' headers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <type_traits>
#include <utility>

#include "shared/model/block.hpp"
#include "shared/model/drive_model.hpp"

namespace flexspline::model {

namespace detail {
// All rows of an image's effects behind each other, each with its end; equal ones once.
struct Rows {
  std::array<std::uint8_t, 400> bytes{};
  std::size_t size = 0;
  constexpr std::uint8_t place(const Row& row) {
    for (std::size_t at = 0; at + row.size < size; ++at) {
      bool same = true;
      for (std::size_t i = 0; i <= row.size; ++i) same = same && bytes[at + i] == row.parts[i];
      if (same) return static_cast<std::uint8_t>(at);
    }
    const std::size_t at = size;
    for (std::size_t i = 0; i <= row.size; ++i) bytes[size++] = row.parts[i];
    return static_cast<std::uint8_t>(at);
  }
};
template <class Model>
struct EffectPlaces {
  struct All {
    std::array<EffectPlace, effects::kLastId + 1> places{};
    std::size_t count = 0;
    Rows rows{};
    std::size_t at = 0;
    std::size_t widest = 1;
  };
  // Bases of a class lie in their order, each as its only member is aligned.
  template <std::size_t Id>
  static constexpr void add(All& all) {
    using Place = typename Model::template PlaceOf<Id>;
    if constexpr (Place::kExists) {
      using C = typename Place::Effect::template Coefficients<typename Model::Numbers>;
      constexpr Row kRow = row_of<C>();
      static_assert(size_in_memory(kRow) == sizeof(C), "the compiler lays this struct out in another way");
      static_assert(std::is_trivially_copyable_v<C>);
      constexpr std::size_t kSets = std::tuple_size_v<decltype(Place::places.coefficients)>;
      all.at = aligned(all.at, alignof(Place));
      all.places[all.count++] = {static_cast<std::uint16_t>(all.at),    sizeof(C),           Id, kSets,
                                 static_cast<std::uint8_t>(alignof(C)), all.rows.place(kRow)};
      all.at += sizeof(Place);
      if (alignof(Place) > all.widest) all.widest = alignof(Place);
    }
  }
  static constexpr All all() {
    All all;
    [&]<std::size_t... Ids>(std::index_sequence<Ids...>) {
      (add<Ids>(all), ...);
    }
    (std::make_index_sequence<effects::kLastId + 1>{});
    return all;
  }
  static_assert(all().count == 0 || aligned(all().at, all().widest) == sizeof(typename Model::Memory),
                "the compiler lays the places out in another way");
  static_assert(all().at < 65536);
  static constexpr std::size_t kCount = all().count;
  static constexpr std::size_t kRowBytes = all().rows.size;
  static_assert(kRowBytes < 256);
  static constexpr auto kPlaces = [] {
    constexpr All kAll = all();
    std::array<EffectPlace, kCount> places{};
    for (std::size_t i = 0; i < kCount; ++i) places[i] = kAll.places[i];
    return places;
  }();
  static constexpr auto kRows = [] {
    constexpr All kAll = all();
    std::array<std::uint8_t, kRowBytes> rows{};
    for (std::size_t i = 0; i < kRowBytes; ++i) rows[i] = kAll.rows.bytes[i];
    return rows;
  }();
};
}  // namespace detail

// The places of a model's effects; sections are added by who knows them.
template <class Model>
constexpr BlockPlaces places_of_model() {
  using Effects = detail::EffectPlaces<Model>;
  return {Effects::kPlaces, Effects::kRows.data(), {}, nullptr};
}

}  // namespace flexspline::model
