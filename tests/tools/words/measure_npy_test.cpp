// Arrays of measures: what is written part after part, through an unnamed file, is what was added.
#include "tools/words/measure_npy.h"

#include "index/export/zip_writer.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_entries.h"
#include "tools/words/npy.h"

#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform::tools {
namespace {

using Kind = MeasureTable::Value::Kind;

TEST(MeasureArrays, LongColumnsKeepTheirValues) {
  constexpr std::size_t kRows = 30'000;
  std::mt19937_64 random(91);  // the seed of the values
  MeasureArrays arrays({{"count", Kind::kCount},
                        {"gaps", Kind::kCount},
                        {"number", Kind::kNumber},
                        {"text", Kind::kText},
                        {"list", Kind::kCounts}});
  std::vector<std::string> texts, columns(5);
  std::vector<std::vector<std::uint64_t>> lists;
  const double none = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t i = 0; i < kRows; ++i) {
    MeasureTable::Row row(5);
    row[0].count = static_cast<std::int64_t>(random() >> 20);
    row[1].count = 3, row[1].number = i % 7 == 0 ? none : 0;
    row[2].number = static_cast<double>(random()) / 7;
    row[3].text = std::string(random() % 9, 'x') + (i % 5 == 0 ? "\xC3\xA9" : "");
    for (std::size_t n = random() % 6; n > 0; --n) row[4].counts.push_back(random() >> 1);
    appendValue(columns[0], row[0].count);
    appendValue(columns[1], i % 7 == 0 ? none : 3.0);
    appendValue(columns[2], row[2].number);
    texts.push_back(row[3].text);
    lists.push_back(row[4].counts);
    for (std::size_t n = 0; n < 5; ++n) appendValue(columns[4], n < lists[i].size() ? lists[i][n] : std::uint64_t{0});
    arrays.add(row);
  }
  columns[0].insert(0, npyHeader("'<i8'", kRows));
  columns[1].insert(0, npyHeader("'<f8'", kRows));
  columns[2].insert(0, npyHeader("'<f8'", kRows));
  columns[3] = npyOfTexts(kRows, [&](std::size_t i) -> std::string_view { return texts[i]; });
  columns[4].insert(0, npyHeader("'<i8'", kRows, 5));
  const test::TempFolder folder;
  writeZip(folder / "m.npz", "m.npz",
           {.entries = 5,
            .name = [](std::size_t i) { return std::to_string(i); },
            .text = {},
            .bytes = [&](std::size_t i) { return arrays.bytes(i); },
            .parts = [&](std::size_t i) { return arrays.parts(i); }});
  const std::map<std::string, std::string> entries = test::entriesOf(folder / "m.npz");
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_TRUE(arrays.npy(i) == columns[i]) << i;
    EXPECT_EQ(arrays.bytes(i), columns[i].size()) << i;
    EXPECT_TRUE(entries.at(std::to_string(i)) == columns[i]) << i;
    const auto next = arrays.parts(i);
    for (std::string part = next(); !part.empty(); part = next()) EXPECT_LE(part.size(), std::size_t{66'000});
  }
}

}  // namespace
}  // namespace filiform::tools
