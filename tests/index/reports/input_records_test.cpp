#include "index/reports/input_records.h"

#include "index/reports/input_report.h"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace filiform {
namespace {

bool same(const InputRecord& a, const InputRecord& b) {
  return a.line == b.line && a.code == b.code && a.effect == b.effect && a.token == b.token;
}

void expectSame(const InputRecords& records, const std::vector<InputRecord>& expected) {
  ASSERT_EQ(records.size(), expected.size());
  std::size_t i = 0;
  for (const InputRecord& record : records) ASSERT_TRUE(same(record, expected.at(i++))) << i;
  ASSERT_EQ(i, expected.size());
}

// Records come by line, equal lines in order of insertion, before and after records went to the store. More than 1 MiB,
// so that the temporary file is used.
TEST(InputRecords, ComeOutAsAStableSortWouldHaveThem) {
  std::mt19937 random(3);
  for (const std::size_t n : {std::size_t{0}, std::size_t{1}, std::size_t{500}, std::size_t{200000}}) {
    InputRecords records;
    std::vector<InputRecord> expected;
    for (std::size_t i = 0; i < n; ++i) {
      InputRecord record;
      // Three interleaved ascending sequences, with runs and equal lines.
      record.line = i / 3 * (1 + i / 1000 % 3) / 2 + (i % 3) * 1000;
      record.code = static_cast<InputCode>(random() % 50 == 0 ? random() % kInputCodes : i % 3);
      record.effect = static_cast<Effect>(random() % 40 == 0 ? random() % 4 : 1);
      if (i < 300 || random() % 4 == 0)
        record.token = std::string(random() % 20, static_cast<char>('a' + random() % 26));
      records.add(record);
      expected.push_back(record);
    }
    std::stable_sort(expected.begin(), expected.end(),
                     [](const InputRecord& a, const InputRecord& b) { return a.line < b.line; });
    expectSame(records, expected);
    records.close();
    const InputRecords copy = records;
    records.clear();
    EXPECT_TRUE(records.empty());
    expectSame(copy, expected);
    for (const Effect effect : {Effect::kRemark, Effect::kLineDropped})
      EXPECT_EQ(copy.count(effect),
                static_cast<std::uint64_t>(std::count_if(expected.begin(), expected.end(),
                                                         [&](const InputRecord& r) { return r.effect == effect; })));
    if (n > 0) {
      EXPECT_TRUE(same(copy[n / 2], expected[n / 2]));
    }
  }
}

TEST(InputRecords, WhatIsAddedFirstComesFirst) {
  InputRecords records;
  records.add({3, InputCode::W_ORDER, Effect::kRemark, "x"});
  records.add({0, InputCode::E_MOSTLY_BAD, Effect::kInputRefused, ""});
  records.close();
  records.addFirst({0, InputCode::W_ZIP_NAME, Effect::kRemark, ""});
  expectSame(records, {{0, InputCode::W_ZIP_NAME, Effect::kRemark, ""},
                       {0, InputCode::E_MOSTLY_BAD, Effect::kInputRefused, ""},
                       {3, InputCode::W_ORDER, Effect::kRemark, "x"}});
}

}  // namespace
}  // namespace filiform
