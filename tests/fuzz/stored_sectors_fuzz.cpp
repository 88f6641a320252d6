// Flash sectors of any content: a start finds a block that is whole and good, or says that it has none; after it a
// block can be stored, and that one is found at the next start.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "shared/storage/parameter_store.hpp"
#include "tests/support/flash_model.hpp"

namespace {

using namespace flexspline;
constexpr std::size_t kSector = 512;
using Cells = tests::FlashCells<kSector>;
using Flash = tests::FlashModel<kSector>;
using Store = storage::ParameterStore<Flash>;

void require(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "stored_sectors_fuzz: %s\n", what);
  std::abort();
}
std::uint32_t validate(std::span<const std::uint8_t> block) {
  return block.size() >= 4 && block[0] == 0x5A ? 0 : 1;
}
std::uint32_t word(const Cells& cells, std::size_t sector, std::size_t at) {
  model::Reader r(std::span<const std::uint8_t>(cells.sectors[sector]).subspan(4 * at, 4));
  return r.take<std::uint32_t>();
}
void put(Cells& cells, std::size_t sector, std::size_t at, std::uint32_t value) {
  model::Writer w(std::span<std::uint8_t>(cells.sectors[sector]).subspan(4 * at, 4));
  w.put(value);
}

}  // namespace

// The first byte: for either sector, whether its checksum and its first slot are made to fit, so that they are no wall.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  Cells cells;
  for (std::size_t i = 1; i < size && i <= 2 * kSector; ++i)
    cells.sectors[(i - 1) / kSector][(i - 1) % kSector] = data[i];
  for (std::size_t s = 0; s < 2; ++s) {
    if ((data[0] >> s & 1) == 0) continue;
    const std::size_t bytes = word(cells, s, 1) % (Store::kCapacity + 1);
    put(cells, s, 0, Store::kMagic);
    put(cells, s, 1, static_cast<std::uint32_t>(bytes));
    const std::uint32_t crc = model::crc32(std::span(cells.sectors[s]).subspan(Store::kHeaderBytes, bytes));
    put(cells, s, 2, crc);
    const std::uint32_t rank = data[0] >> (2 + s) & 0x7F;
    put(cells, s, 4, (crc ^ rank) * 0x9E3779B1U);
    put(cells, s, 5, rank | (~rank << 16));
  }
  const Cells before = cells;
  Flash flash(cells);
  Store store(flash);
  const storage::StoreState state = store.boot(validate);
  require(before.sectors == cells.sectors, "a start writes");
  const bool has = state == storage::StoreState::good || state == storage::StoreState::fell_back;
  require(has == !store.active().empty(), "the state does not fit what there is");
  for (const auto block : {store.active(), store.previous()})
    require(block.empty() || validate(block) == 0, "it gives out a block that is not good");
  std::uint32_t reason = 0;
  store.restore(validate, reason);
  const std::vector<std::uint8_t> fresh(40, 0x5A);
  require(store.begin(fresh.size(), model::crc32(fresh)) == storage::StoreError::none, "nothing can be staged");
  require(store.write(0, fresh) == storage::StoreError::none, "nothing can be written");
  const storage::StoreError done = store.commit(validate, reason);
  require(done == storage::StoreError::none || done == storage::StoreError::worn, "nothing can be committed");
  Flash flash2(cells);
  Store again(flash2);
  again.boot(validate);
  if (done == storage::StoreError::none)
    require(std::ranges::equal(again.active(), fresh), "what was committed is not found at the next start");
  return 0;
}
