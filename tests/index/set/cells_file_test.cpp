#include "index/set/internal/cells_file.h"

#include "index/file/internal/bytes.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

TEST(CellsFile, ARootThatCountsMoreCellsThanItHasPagesIsDamage) {
  for (const std::uint32_t cells : {std::uint32_t{1}, UINT32_MAX - 255, UINT32_MAX - 254, UINT32_MAX}) {
    ByteWriter root;
    root.u32(cells);
    root.u32(0);  // names
    EXPECT_THROW(decodeCellsRoot(root.bytes(), 0), Damage) << cells;
  }
}

}  // namespace
}  // namespace filiform::internal
