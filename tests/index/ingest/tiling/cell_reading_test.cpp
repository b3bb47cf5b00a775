#include "index/ingest/tiling/internal/cell_reading.h"

#include "index/errors.h"
#include "tests/support/scenes/random_cells.h"

#include <gtest/gtest.h>

namespace filiform::internal {
namespace {

// Cells of 1 to 300 samples, and some that a reader takes apart itself.
std::vector<Cell> mixedCells(std::uint64_t seed, std::uint32_t n) {
  std::vector<Cell> cells;
  for (std::uint32_t i = 0; i < n; ++i) {
    const bool large = i % 50 == 20;
    cells.push_back(large ? test::longNeurite(static_cast<std::uint32_t>(Cell::kSamplesKept) + 100, 0.5)
                          : test::randomNeuron(seed + i, {.samples = 1 + i * 7 % 300}));
    cells.back().source = "cell " + std::to_string(100000 + i);
    cells.back().digest = i;
  }
  return cells;
}

struct Read {
  Spool spool{"", 4096, UINT64_MAX};
  CellIntake intake{spool};
  Chunks chunks{spool, 1000, 64};
  LandmarkSurvey survey;

  void run(
      CellStream& stream, unsigned threads, const std::function<void(std::size_t)>& check = [](std::size_t) {}) {
    const CellReading reading{.grid = Grid(),
                              .most_in_chunk = 1000,
                              .most_open = 64,
                              .threads = threads,
                              .progress = [](std::uint64_t) {},
                              .check = check};
    readCells(stream, reading, spool, intake, chunks, survey);
    intake.finish();
  }
};

TEST(ReadCells, ThreadsKeepWhatOneThreadKeepsInItsOrder) {
  Read one;
  CellList first(mixedCells(91, 600));
  one.run(first, 1);
  std::vector<Bytes> details;
  one.intake.readDetails([&](std::uint32_t, ByteSpan detail) { details.emplace_back(detail.begin(), detail.end()); });
  for (const unsigned threads : {2u, 5u}) {
    Read several;
    CellList stream(mixedCells(91, 600));
    unsigned checks = 0;
    several.run(stream, threads, [&](std::size_t blocks) {
      ++checks;
      EXPECT_GT(blocks, 0u);
    });
    EXPECT_EQ(checks, 2u);
    ASSERT_EQ(several.intake.records().size(), 600u);
    EXPECT_EQ(several.intake.digests(), one.intake.digests());
    EXPECT_EQ(several.intake.segments(), one.intake.segments());
    EXPECT_EQ(several.survey.encode(), one.survey.encode());
    for (std::size_t c = 0; c < 600; ++c) EXPECT_EQ(several.intake.records()[c].name, one.intake.records()[c].name);
    several.intake.readDetails(
        [&](std::uint32_t cell, ByteSpan detail) { EXPECT_EQ(Bytes(detail.begin(), detail.end()), details[cell]); });
  }
}

TEST(ReadCells, ACellThatCannotBeTakenEndsTheReading) {
  for (const std::size_t bad : {0u, 7u, 599u}) {
    std::vector<Cell> cells = mixedCells(92, 600);
    cells[bad].types.pop_back();
    CellList stream(std::move(cells));
    Read read;
    EXPECT_THROW(read.run(stream, 3), UsageError);
  }
}

class Broken final : public CellStream {
 public:
  bool next(Cell& cell) override {
    if (++cells_ == 300) throw IoError("cells", "cannot be read", EIO);
    cell = test::randomNeuron(cells_, {.samples = 50});
    return true;
  }

 private:
  std::uint64_t cells_ = 0;
};

TEST(ReadCells, AStreamThatFailsEndsTheReading) {
  Broken stream;
  Read read;
  EXPECT_THROW(read.run(stream, 3), IoError);
}

}  // namespace
}  // namespace filiform::internal
