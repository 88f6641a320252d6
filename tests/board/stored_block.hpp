// A parameter block in a board's flash, as the drive itself would have stored it.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <span>
#include <vector>

#include "shared/model/block.hpp"
#include "shared/storage/parameter_store.hpp"

namespace flexspline::tests {

template <class Port>
void store(Port port, const std::vector<std::uint8_t>& block) {
  storage::ParameterStore<Port> into(port);
  const auto good = [](std::span<const std::uint8_t>) { return 0U; };
  std::uint32_t reason = 0;
  into.boot(good);
  EXPECT_EQ(into.begin(block.size(), model::crc32(block)), storage::StoreError::none);
  EXPECT_EQ(into.write(0, block), storage::StoreError::none);
  EXPECT_EQ(into.commit(good, reason), storage::StoreError::none);
}

}  // namespace flexspline::tests
