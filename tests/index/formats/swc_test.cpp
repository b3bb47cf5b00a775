#include "index/formats/swc.h"

#include "index/errors.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using namespace std::string_literals;

// The result of reading as one line: severity, samples, segments, dropped lines, codes.
std::string rowOf(const InputReport& report) {
  std::string dropped, codes;
  for (const InputRecord& record : report.records) {
    if (record.effect == Effect::kLineDropped) dropped += (dropped.empty() ? "" : ",") + std::to_string(record.line);
  }
  for (const auto& [code, count] : report.codes.all()) {
    codes += (codes.empty() ? "" : ",") + std::string(name(code)) + ":" + std::to_string(count);
  }
  return std::string(name(report.severity)) + " " + std::to_string(report.samples) + " " +
         std::to_string(report.segments) + " " + (dropped.empty() ? "-" : dropped) + " " +
         (codes.empty() ? "-" : codes);
}

struct Reading {
  Cell cell;
  InputReport report;
  std::string row;
};

Reading read(const std::string& text, const SwcOptions& options = {}) {
  Reading reading;
  reading.report = readSwc(text, "test.swc", options, reading.cell);
  reading.row = rowOf(reading.report);
  return reading;
}

std::string row(const std::string& text, const SwcOptions& options = {}) { return read(text, options).row; }

// Two valid lines, then the test's own as line 3.
std::string withLine(const std::string& line) { return "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n" + line + "\n"; }

constexpr std::uint32_t kRoot = kNoParent;

TEST(SwcReader, KeepsAllFieldsOfAPlainFile) {
  const Reading reading = read("# made up\n1 1 0.1 -2e-1 +3 5 -1\n2 3 1 6 0 0.25 1\n3 274 1 7 0 1 2\n");
  EXPECT_EQ(reading.row, "accept 3 2 - -");
  EXPECT_EQ(reading.cell.sample_ids, (std::vector<std::int64_t>{1, 2, 3}));
  EXPECT_EQ(reading.cell.parents, (std::vector<std::uint32_t>{kRoot, 0, 1}));
  EXPECT_EQ(reading.cell.types, (std::vector<std::uint16_t>{1, 3, 274}));
  EXPECT_EQ(reading.cell.radii_um, (std::vector<float>{5, 0.25, 1}));
  EXPECT_EQ(reading.cell.positions_um[0], Vector3d(0.1, -0.2, 3));
  EXPECT_EQ(reading.report.roots, 1u);
  EXPECT_EQ(reading.report.isolated, 0u);
}

TEST(SwcReader, EveryDecimalIsTheNearestDouble) {
  std::mt19937_64 random(1549);
  std::string text;
  std::vector<std::string> decimals = {"-0", "-0.0", ".5", "7.", "0.000000000000001", "99999.9999999999"};
  for (int i = 0; i < 3000; ++i) {
    const std::size_t whole = random() % 6, decimal = random() % 16;
    std::string number = random() % 2 == 0 ? "-" : "";
    for (std::size_t k = 0; k < whole; ++k) number += static_cast<char>('0' + random() % 10);
    if (decimal > 0) number += ".";
    for (std::size_t k = 0; k < decimal; ++k) number += static_cast<char>('0' + random() % 10);
    if (whole + decimal > 0) decimals.push_back(number);
  }
  for (std::size_t i = 0; i < decimals.size(); ++i)
    text += std::to_string(i + 1) + " 3 " + decimals[i] + " 0 0 1 " + (i == 0 ? "-1" : std::to_string(i)) + "\n";
  const Reading reading = read(text);
  ASSERT_EQ(reading.cell.positions_um.size(), decimals.size());
  for (std::size_t i = 0; i < decimals.size(); ++i)
    EXPECT_EQ(std::bit_cast<std::uint64_t>(reading.cell.positions_um[i][0]),
              std::bit_cast<std::uint64_t>(std::strtod(decimals[i].c_str(), nullptr)))
        << decimals[i];
}

TEST(SwcReader, AcceptsEveryLegalForm) {
  EXPECT_EQ(row("1 1 0 0 0 5 -1\n2 3 0 6 0 1 -1\n3 3 0 6 0 1 -1\n"), "accept 3 0 - -");
  EXPECT_EQ(row("30 1 0 0 0 5 -1\n10 3 0 6 0 1 30\n20 3 0 6 0 1 10\n"), "accept 3 2 - -");
  EXPECT_EQ(row("0 1 0 0 0 5 -1\n1 3 0 6 0 1 0\n"), "accept 2 1 - -");
  EXPECT_EQ(row("1 1 0 0 0 5 -1\r\n\r\n 2\t 3 0 6 0 1 1 \t\r\n"), "accept 2 1 - -");
  EXPECT_EQ(row("1 1 0 0 0 5 -1 # soma, of 3 kinds\n2 3 0 6 0 1 1# glued\n#\n   # late"), "accept 2 1 - -");
  EXPECT_EQ(row("001 01 .5 6. 1e-400 9e-1 -1\n+2 +3 -5E-1 +1.2e1 0 1 +1"), "accept 2 1 - -");
  EXPECT_EQ(row("4294967297 1 0 0 0 5 -1\n9223372036854775807 3 0 6 0 1 4294967297\n"), "accept 2 1 - -");
  EXPECT_EQ(row("1 65535 0 0 0 5.0 -1.0\n2 3.00 0 6 0 1 1.0\n"), "accept 2 1 - -");
}

TEST(SwcReader, CountsRootsAndIsolatedSamples) {
  const Reading reading = read("1 1 0 0 0 5 -1\n2 3 0 6 0 1 -1\n3 3 0 6 0 1 2\n4 3 0 6 0 1 -1\n");
  EXPECT_EQ(reading.report.roots, 3u);
  EXPECT_EQ(reading.report.isolated, 2u);
}

TEST(SwcReader, ParentAfterChildIsKept) {
  const Reading reading = read("1 1 0 0 0 4 -1\n2 2 0 18 0 1 3\n3 2 0 12 0 1 1\n");
  EXPECT_EQ(reading.row, "warn 3 2 - W_ORDER:1");
  EXPECT_EQ(reading.cell.parents, (std::vector<std::uint32_t>{kRoot, 2, 0}));
  EXPECT_EQ(reading.report.records[0].line, 2u);
}

TEST(SwcReader, FloatIdIsKept) {
  EXPECT_EQ(row(withLine("3.0 3 0 12 0 1 2.0")), "warn 3 2 - W_FLOAT_ID:1");
  EXPECT_EQ(row(withLine("3e0 3 0 12 0 1 2")), "warn 3 2 - W_FLOAT_ID:1");
  EXPECT_EQ(read(withLine("9007199254740993.000 3 0 12 0 1 2")).cell.sample_ids[2], 9007199254740993);
}

TEST(SwcReader, BadIdDropsTheSample) {
  for (const char* id :
       {"-3", "2.5", "9223372036854775808", "99999999999999999999", "1e16", "1e400", "1e-400", "-1.0"}) {
    EXPECT_EQ(row(withLine(id + " 3 0 12 0 1 2"s)), "warn 2 1 3 W_BAD_ID:1") << id;
  }
}

TEST(SwcReader, ParentOfADroppedSampleIsCut) {
  EXPECT_EQ(row(withLine("3 3 nan 12 0 1 2") + "4 3 0 18 0 1 3\n"), "warn 3 1 3 W_MISSING_PARENT:1,W_NONFINITE:1");
  EXPECT_EQ(row(withLine("-3 3 0 12 0 1 2") + "4 3 0 18 0 1 -3\n"), "warn 3 1 3 W_BAD_ID:1,W_ROOT_CODE:1");
  EXPECT_EQ(row("0 1 0 inf 0 4 -1\n1 3 0 6 0 1 0\n"), "warn 1 0 1 W_MISSING_PARENT:1,W_NONFINITE:1");
}

TEST(SwcReader, DuplicateIdKeepsTheFirst) {
  const Reading reading = read(withLine("2 2 50 50 50 2 1") + "4 3 0 9 0 1 2\n");
  EXPECT_EQ(reading.row, "warn 3 2 3 W_DUP_ID:1");
  EXPECT_EQ(reading.cell.positions_um[1], Vector3d(0, 6, 0));
  EXPECT_EQ(row("5 1 0 0 0 4 -1\n1 3 0 6 0 1 5\n5 3 0 7 0 1 1\n"), "warn 2 1 3 W_DUP_ID:1");
}

TEST(SwcReader, ADroppedSampleDoesNotTakeItsId) {
  EXPECT_EQ(row("1 1 0 0 0 4 -1\n2 3 0 NA 0 1 1\n2 3 0 6 0 1 1\n"), "warn 2 1 2 W_NONFINITE:1");
}

TEST(SwcReader, RestartedIdsBeginANewBlock) {
  const Reading reading =
      read("1 1 0 0 0 4 -1\n2 3 0 6 0 1 1\n1 1 80 0 0 4 -1\n2 3 80 6 0 1 1\n3 3 80 9 0 1 2\n1 1 9 9 9 1 -1\n");
  EXPECT_EQ(reading.row, "warn 6 3 - W_ID_RESTART:2");
  EXPECT_EQ(reading.cell.block_starts, (std::vector<std::uint32_t>{2, 5}));
  EXPECT_EQ(reading.cell.parents, (std::vector<std::uint32_t>{kRoot, 0, kRoot, 2, 3, kRoot}));
}

TEST(SwcReader, ARestartIsFoundWhenRootsAreMarkedZero) {
  EXPECT_EQ(row("1 1 0 0 0 4 0\n2 3 0 6 0 1 1\n1 1 80 0 0 4 0\n2 3 80 6 0 1 1\n"),
            "warn 4 2 - W_ID_RESTART:1,W_ROOT_CODE:2");
}

TEST(SwcReader, ARestartNeedsABlockOfMoreThanOneSample) {
  EXPECT_EQ(row("1 1 0 0 0 4 -1\n1 1 0 0 0 4 -1\n2 3 0 6 0 1 1\n"), "warn 2 1 2 W_DUP_ID:1");
}

TEST(SwcReader, LinksStayInTheirBlock) {
  EXPECT_EQ(row("1 1 0 0 0 4 -1\n2 3 0 6 0 1 1\n1 1 80 0 0 4 -1\n3 3 80 6 0 1 2\n"),
            "warn 4 1 - W_ID_RESTART:1,W_MISSING_PARENT:1");
}

TEST(SwcReader, OwnParentIsCut) { EXPECT_EQ(row(withLine("3 3 0 12 0 1 3")), "warn 3 1 - W_SELF_PARENT:1"); }

TEST(SwcReader, ACycleIsCutAtItsLowestLine) {
  const Reading reading =
      read("1 1 0 0 0 4 -1\n7 2 5 0 0 1 6\n4 2 3 0 0 1 7\n5 2 3 5 0 1 4\n6 2 3 2 0 1 5\n8 2 0 0 1 1 6\n");
  EXPECT_EQ(reading.row, "warn 6 4 - W_CYCLE:1");
  EXPECT_EQ(reading.cell.parents, (std::vector<std::uint32_t>{kRoot, kRoot, 1, 2, 3, 4}));
  EXPECT_EQ(reading.report.records[0].line, 2u);
  EXPECT_EQ(row("1 3 0 0 0 1 2\n2 3 1 0 0 1 1\n3 3 0 0 0 1 4\n4 3 1 0 0 1 3\n"), "warn 4 2 - W_CYCLE:2");
}

TEST(SwcReader, ACycleKeepsItsOtherLaterParents) {
  // 1 -> 3 -> 2 -> 1: the link of line 1 is cut; the link of line 2 points forward and stays.
  EXPECT_EQ(row("1 3 0 0 0 1 2\n2 3 1 0 0 1 3\n3 3 1 1 0 1 1\n"), "warn 3 2 - W_CYCLE:1,W_ORDER:1");
}

TEST(SwcReader, MissingParentBecomesARoot) {
  EXPECT_EQ(row(withLine("3 3 0 12 0 1 77")), "warn 3 1 - W_MISSING_PARENT:1");
}

TEST(SwcReader, RootCodesOtherThanMinusOneAreRoots) {
  EXPECT_EQ(row(withLine("3 3 0 12 0 1 -7")), "warn 3 1 - W_ROOT_CODE:1");
  EXPECT_EQ(row(withLine("3 3 0 12 0 1 0")), "warn 3 1 - W_ROOT_CODE:1");
  EXPECT_EQ(row(withLine("3 3 0 12 0 1 -99999999999999999999")), "warn 3 1 - W_ROOT_CODE:1");
}

TEST(SwcReader, UnreadableParentBecomesARoot) {
  for (const char* parent : {"None", "1.5", "nan", "99999999999999999999", "1e300", "--1"}) {
    EXPECT_EQ(row(withLine("3 3 0 12 0 1 "s + parent)), "warn 3 1 - W_BAD_PARENT:1") << parent;
  }
}

TEST(SwcReader, ZeroRadiusIsKept) {
  EXPECT_EQ(row(withLine("3 3 0 12 0 0.0 2")), "warn 3 2 - W_ZERO_RADIUS:1");
  EXPECT_EQ(row(withLine("3 3 0 12 0 -0 2")), "warn 3 2 - W_ZERO_RADIUS:1");
  const Reading tiny = read(withLine("3 3 0 12 0 1e-60 2"));
  EXPECT_EQ(tiny.row, "accept 3 2 - -");
  EXPECT_GT(tiny.cell.radii_um[2], 0.0f);
}

TEST(SwcReader, BadRadiusIsUnknown) {
  for (const char* radius : {"-1", "NaN", "inf", "-inf", "1e400", "1e39", "wide", "1.#IND", "NA"}) {
    const Reading reading = read(withLine("3 3 0 12 0 "s + radius + " 2"));
    EXPECT_EQ(reading.row, "warn 3 2 - W_BAD_RADIUS:1") << radius;
    EXPECT_TRUE(std::isnan(reading.cell.radii_um[2])) << radius;
  }
}

TEST(SwcReader, BadTypeIsZero) {
  for (const char* type : {"-1", "65536", "axon", "2.5", "nan", "1e30", "0x3"}) {
    const Reading reading = read(withLine("3 "s + type + " 0 12 0 1 2"));
    EXPECT_EQ(reading.row, "warn 3 2 - W_BAD_TYPE:1") << type;
    EXPECT_EQ(reading.cell.types[2], 0u) << type;
  }
}

TEST(SwcReader, NonfiniteCoordinateDropsTheSample) {
  for (const char* x :
       {"nan", "-NaN", "inf", "-Infinity", "NA", "1.#IND", "-1.#IND00", "1.#INF", "1.#QNAN", "1e400", "-1E+999"}) {
    EXPECT_EQ(row(withLine("3 3 0 "s + x + " 0 1 2")), "warn 2 1 3 W_NONFINITE:1") << x;
  }
}

TEST(SwcReader, CoordinateOutOfRangeDropsTheSample) {
  EXPECT_EQ(row(withLine("3 3 0 12 -1.0000001e9 1 2")), "warn 2 1 3 W_RANGE:1");
  EXPECT_EQ(row(withLine("3 3 0 12 1e9 1 2")), "accept 3 2 - -");
}

TEST(SwcReader, CoordinateOutOfRangeOnceConvertedDropsTheSample) {
  EXPECT_EQ(row(withLine("3 3 2000000 12 0 1 2"), {.unit_um = 1000}), "warn 2 1 3 W_RANGE:1");
  EXPECT_EQ(row("# OFFSET 9e8 0 0\n" + withLine("3 3 2e8 12 0 1 2"), {.apply_offset = true}), "warn 2 1 4 W_RANGE:1");
}

TEST(SwcReader, ShortLineIsDropped) {
  EXPECT_EQ(row(withLine("3 3 0 12 0 1")), "warn 2 1 3 W_SHORT_LINE:1");
  EXPECT_EQ(row(withLine("3 3 0 12 0 1 # 2")), "warn 2 1 3 W_SHORT_LINE:1");
  EXPECT_EQ(row(withLine("3,3,0,12,0,1,")), "warn 2 1 3 W_SHORT_LINE:1");
}

TEST(SwcReader, UnreadableNumberDropsTheLine) {
  for (const char* x : {"0x1F", "1.5D+01", "1.2.3", "left", "1_000", "1e", ".", "+-5", "5um",
                        "\xE2\x88\x92"
                        "5"}) {
    EXPECT_EQ(row(withLine("3 3 0 "s + x + " 0 1 2")), "warn 2 1 3 W_BAD_LINE:1") << x;
  }
  for (const char* id : {"x", "0x3", "nan", "3a"}) {
    EXPECT_EQ(row(withLine(id + " 3 0 1 0 1 2"s)), "warn 2 1 3 W_BAD_LINE:1") << id;
  }
}

TEST(SwcReader, ADroppedLineHasOneRecord) {
  EXPECT_EQ(row(withLine("x many y nan -1 oops none 8 9")), "warn 2 1 3 W_BAD_LINE:1");
  EXPECT_EQ(row(withLine("3.5 soma nan 2e9 0 -1 none 8 9")), "warn 2 1 3 W_BAD_ID:1");
}

TEST(SwcReader, ExtraColumnsAreIgnored) {
  EXPECT_EQ(row(withLine("3 3 0 12 0 1 2 9 a,b 0,5")), "warn 3 2 - W_EXTRA_COLUMNS:1");
}

TEST(SwcReader, CommasAndSemicolonsSeparate) {
  EXPECT_EQ(row("1,1,0,0,0,5,-1\n2, 3, 0.5, 6, 0, 1, 1\n"), "warn 2 1 - W_SEPARATOR:1");
  EXPECT_EQ(row("1;1;0;0;0;5;-1;\n2 ;3 ;0 ;6 ;0 ;1 ;1 # a, b and c 0,5 too\n"), "warn 2 1 - W_SEPARATOR:1");
  EXPECT_EQ(row("1,1,0,0,0,5,-1 # changed 0,5 to 0,6 in x y z\n"), "warn 1 0 - W_SEPARATOR:1");
}

TEST(SwcReader, WithoutASampleNothingIsSaidOfSeparators) {
  EXPECT_EQ(row("a,b,c,d,e,f,g\n1,2,3,4,x,6,7\n"), "refuse 0 0 1,2 E_NO_SAMPLES:1,W_BAD_LINE:2");
}

TEST(SwcReader, ABadTypeHidesNoFloatId) {
  EXPECT_EQ(row("1.0 soma 0 0 0 5 -1\n2.0 2.5 0 6 0 1 1.0\n3.0 3.0 0 9 0 1 2.0\n"),
            "warn 3 2 - W_BAD_TYPE:2,W_FLOAT_ID:3");
}

TEST(SwcReader, AnEmptyColumnDoesNotShiftTheOthers) {
  EXPECT_EQ(row(withLine("3,3,,12,0,1,2,7")), "warn 2 1 3 W_BAD_LINE:1,W_SEPARATOR:1");
  EXPECT_EQ(row(withLine("3,,0,12,0,1,2")), "warn 3 2 - W_BAD_TYPE:1,W_SEPARATOR:1");
}

TEST(SwcReader, DecimalCommasRefuseTheFile) {
  EXPECT_EQ(row(withLine("3 3 0,5 12 0 1 2")), "refuse 0 0 - E_DECIMAL_COMMA:1");
  EXPECT_EQ(row("1;1;0,0;6,5;0;1;-1\n"), "refuse 0 0 - E_DECIMAL_COMMA:1");
  EXPECT_EQ(row("1, 1, 0,5, 6,5, 0, 1, -1\n"), "refuse 0 0 - E_DECIMAL_COMMA:1");
  EXPECT_TRUE(read(withLine("3 3 0,5 12 0 1 2")).cell.positions_um.empty());
}

TEST(SwcReader, ThousandsSeparatorsRefuseTheFile) {
  EXPECT_EQ(row(withLine("3 3 1,234.5 12 0 1 2")), "refuse 0 0 - E_DECIMAL_COMMA:1");
  EXPECT_EQ(row(withLine("3 3 1,234,567 12 0 1 2")), "refuse 0 0 - E_DECIMAL_COMMA:1");
  EXPECT_EQ(row(withLine("3 3 1.234,5 12 0 1 2")), "refuse 0 0 - E_DECIMAL_COMMA:1");
}

TEST(SwcReader, NulInACommentIsKeptAndInADataLineDropsIt) {
  EXPECT_EQ(row("# a\0\0b\n"s + withLine("3 3 0 12 0 1 2")), "warn 3 2 - W_NUL:1");
  EXPECT_EQ(row(withLine("3 3 0 12 0 1 2\0"s)), "warn 2 1 3 W_NUL:1");
}

TEST(SwcReader, ALongDataLineIsDropped) {
  const auto padded = [](std::size_t length) {
    std::string line = "3 3 0 12 0 1 2";
    return line + std::string(length - line.size(), ' ');
  };
  EXPECT_EQ(row(withLine(padded(SwcReader::kMaxDataLine))), "accept 3 2 - -");
  EXPECT_EQ(row(withLine(padded(SwcReader::kMaxDataLine + 1))), "warn 2 1 3 W_LONG_LINE:1");
  EXPECT_EQ(row(withLine("#" + std::string(300000, 'c'))), "accept 2 1 - -");
  EXPECT_EQ(row(withLine(std::string(200000, ' '))), "accept 2 1 - -");
}

TEST(SwcReader, ByteOrderMarkIsSkipped) {
  EXPECT_EQ(row("\xEF\xBB\xBF"
                "1 1 0 0 0 5 -1\n"),
            "warn 1 0 - W_BOM:1");
}

TEST(SwcReader, LoneCarriageReturnsEndLines) {
  EXPECT_EQ(row("# c\r1 1 0 0 0 5 -1\r2 3 0 6 0 1 1\r"), "warn 2 1 - W_CR:1");
  EXPECT_EQ(row("1 1 0 0 0 5 -1\r\n2 3 0 6 0 1 1\r3 3 0 7 0 1\n"), "warn 2 1 3 W_CR:1,W_SHORT_LINE:1");
  EXPECT_EQ(row("1 1 0 0 0 5 -1\r\n2 3 0 6 0 1 1\r"), "accept 2 1 - -");
}

TEST(SwcReader, ScaleInTheHeaderIsNeverApplied) {
  const Reading reading = read("#scale: 0.5\n" + withLine("3 3 0 12 0 1 2"), {.apply_offset = true});
  EXPECT_EQ(reading.row, "warn 3 2 - W_HEADER_SCALE:1");
  EXPECT_EQ(reading.report.header.scale, Vector3d(0.5, 0.5, 0.5));
  EXPECT_EQ(reading.cell.positions_um[2], Vector3d(0, 12, 0));
  EXPECT_EQ(row("# SCALE 1.0 1.0 1.0 micrometers\n# OFFSET 0 0 0\n# SCALED 2\n" + withLine("3 3 0 12 0 1 2")),
            "accept 3 2 - -");
}

TEST(SwcReader, OffsetInTheHeaderIsAppliedOnRequestOnly) {
  const std::string text = "# OFFSET 100.5 0 -7\n" + withLine("3 3 0 12 0 1 2");
  const Reading plain = read(text);
  EXPECT_EQ(plain.row, "warn 3 2 - W_HEADER_SCALE:1");
  EXPECT_EQ(plain.cell.positions_um[2], Vector3d(0, 12, 0));
  const Reading applied = read(text, {.unit_um = 2, .apply_offset = true});
  EXPECT_EQ(applied.row, "accept 3 2 - -");
  EXPECT_EQ(applied.cell.positions_um[2], Vector3d(201, 24, -14));
  EXPECT_EQ(applied.cell.radii_um[2], 2.0f);
}

TEST(SwcReader, CommentsBeforeTheFirstSampleAreKept) {
  const std::string sample = "1 1 0 0 0 1 -1\n";
  EXPECT_EQ(read("# one\r\n\n \t#two \n" + sample + "# three\n").cell.header, "# one\n#two ");
  EXPECT_EQ(read(sample).cell.header, "");
  EXPECT_EQ(read("# only comments\n").cell.header, "");
  SwcReader reader;  // which starts anew with each file
  for (const char* const header : {"# one", "# two"}) {
    Cell cell;
    reader.feed(header + std::string("\n") + sample);
    reader.finish("a.swc", cell);
    EXPECT_EQ(cell.header, header);
  }
}

TEST(SwcReader, WhatWasAppliedOfTheHeaderIsNotAppliedAgain) {
  const std::string text = "# OFFSET 100.5 0 -7\n# unit: nm\n# plain\n1 1 0 0 0 1 -1\n";
  EXPECT_EQ(read(text).cell.header, "# OFFSET 100.5 0 -7\n# unit: nm\n# plain");
  const std::string applied = read(text, {.unit_um = 1e-3, .apply_offset = true}).cell.header;
  EXPECT_EQ(applied, "# (applied) OFFSET 100.5 0 -7\n# (applied) unit: nm\n# plain");
  EXPECT_EQ(row(applied + "\n1 1 0 0 0 1 -1\n"), "accept 1 0 - -");
}

TEST(SwcReader, ALongHeaderIsCutAndSaysSo) {
  std::string text;
  for (int i = 0; i < 20000; ++i) text += "# line\n";
  const std::string header = read(text + "1 1 0 0 0 1 -1\n").cell.header;
  EXPECT_LT(header.size(), Cell::kMostHeader + 100);
  const std::string last = header.substr(header.rfind('\n') + 1);
  const auto kept = static_cast<int>(std::count(header.begin(), header.end(), '\n'));
  EXPECT_EQ(last, "# (" + std::to_string(20000 - kept) + " more lines of the source's header are left out)");
}

TEST(SwcReader, RadiiThatAFloatDoesNotNameAreKeptInFull) {
  const Reading reading = read("1 1 0 0 0 0.123456789 -1\n2 3 0 1 0 0.5 1\n3 3 0 2 0 0.6700000166893005 2\n");
  EXPECT_EQ(reading.cell.odd_radii, (std::vector<OddRadius>{{0, 0.123456789}, {2, 0.6700000166893005}}));
  EXPECT_EQ(read("1 1 0 0 0 1.5e-50 -1\n").cell.odd_radii, (std::vector<OddRadius>{{0, 1.5e-50}}));
  EXPECT_TRUE(read("1 1 0 0 0 350 -1\n2 1 0 0 1 0.1 1\n", {.unit_um = 1e-3}).cell.odd_radii.empty());
}

TEST(SwcReader, ForeignUnitInTheHeaderIsSaidOnce) {
  EXPECT_EQ(row("# unit: nm\n# coordinates are Voxels\n" + withLine("3 3 0 12 0 1 2")), "warn 3 2 - W_UNITS:1");
  EXPECT_EQ(read("# unit: nm\n1 1 0 0 0 1 -1\n").report.header.units, "nm");
  EXPECT_EQ(row("# unit: nm\n" + withLine("3 3 0 12 0 1 2"), {.unit_um = 1e-3}), "accept 3 2 - -");
  EXPECT_EQ(row("# traced from smoothed_pixel.swc, 512 pixel images\n# units: um\n1 1 0 0 0 1 -1\n"), "accept 1 0 - -");
}

TEST(SwcReader, AHeaderThatStatesMicrometresNamesNoOtherUnit) {
  for (const char* header :
       {"# in micrometers - steps: subtract origin, add 1 to xyz, scale by voxel size\n",
        "# unit: um\n# xyz = index * voxel size\n", "# xyz = index * voxel size\n# coordinates in \xC2\xB5m\n",
        "# coordinates: microns (voxel 0.1 nm)\n"})
    EXPECT_EQ(row(header + withLine("3 3 0 12 0 1 2")), "accept 3 2 - -") << header;
  for (const char* header : {"# units: pixels of 0.2 um\n", "# SCALE 1 1 1 um per pixel\n",
                             "# coordinates: um/voxel 0.2\n", "# steps of 1 um\n# coordinates are voxels\n"})
    EXPECT_EQ(row(header + withLine("3 3 0 12 0 1 2")), "warn 3 2 - W_UNITS:1") << header;
}

TEST(SwcReader, TheCellKnowsTheLineOfEachSample) {
  const Cell cell = read("# a\n1 1 0 0 0 1 -1\n2 3 1 0 0 1 1\n\n# b\n2 3 9 9 9 1 1\n3 3 2 0 0 1 2\n").cell;
  EXPECT_EQ(cell.line(0), 2u);
  EXPECT_EQ(cell.line(1), 3u);
  EXPECT_EQ(cell.line(2), 7u);
  EXPECT_EQ(Cell().line(0), 0u);
}

TEST(SwcReader, WideEncodingsAreRefused) {
  std::string wide, big, wide32;
  for (const char c : withLine("3 3 0 12 0 1 2")) {
    wide += {c, '\0'};
    big += {'\0', c};
    wide32 += {c, '\0', '\0', '\0'};
  }
  for (const std::string& text : {wide, big, wide32, "\xFF\xFE" + wide, "\xFE\xFF" + big}) {
    EXPECT_EQ(row(text), "refuse 0 0 - E_ENCODING:1");
  }
}

// Neither mark, nor NULs in nearly all pairs: most characters of the comment are beyond Latin-1.
TEST(SwcReader, WideTextOfAnotherScriptIsRefusedAsSuch) {
  std::string little, big;
  for (int i = 0; i < 60; ++i) {
    little += "\x2C\x67";
    big += "\x67\x2C";
  }
  for (const char c : "\n" + withLine("3 3 0 12 0 1 2")) {
    little += {c, '\0'};
    big += {'\0', c};
  }
  EXPECT_EQ(row(std::string("#\0", 2) + little), "refuse 0 0 - E_ENCODING:1");
  EXPECT_EQ(row(std::string("\0#", 2) + big), "refuse 0 0 - E_ENCODING:1");
  EXPECT_EQ(row(std::string("1\0 \0", 4)), "refuse 0 0 - E_ENCODING:1");
}

TEST(SwcReader, WhatIsNotTextIsRefused) {
  EXPECT_EQ(row("\x1F\x8B\b\0"s), "refuse 0 0 - E_NOT_TEXT:1");
  EXPECT_EQ(row("PK\3\4 1 1 0 0 0 1 -1\n"), "refuse 0 0 - E_NOT_TEXT:1");
  EXPECT_EQ(row("\x89HDF\r\n\x1A\n"s), "refuse 0 0 - E_NOT_TEXT:1");
  EXPECT_EQ(row(std::string(100000, '\0')), "refuse 0 0 - E_NOT_TEXT:1");
  EXPECT_EQ(row(std::string(8000, '#') + "\n1 1 0 0 0 1 -1\n" + std::string(4000, '\0')), "refuse 0 0 - E_NOT_TEXT:1");
}

TEST(SwcReader, WithoutASampleItIsRefused) {
  EXPECT_EQ(row(""), "refuse 0 0 - E_NO_SAMPLES:1");
  EXPECT_EQ(row("# only\n\n"), "refuse 0 0 - E_NO_SAMPLES:1");
  EXPECT_EQ(row("<html>\n<p>sorry, later</p>\n"), "refuse 0 0 1,2 E_NO_SAMPLES:1,W_SHORT_LINE:2");
}

TEST(SwcReader, MostlyUnreadableIsRefused) {
  EXPECT_EQ(row("1 1 0 0 0 5 -1\nx\n2 3 0 1 0 1 1\ny\n"), "warn 2 1 2,4 W_SHORT_LINE:2");
  const Reading reading = read("1 1 0 0 0 5 -1\nx\n2 3 0 1 0 1 1\ny\nz\n");
  EXPECT_EQ(reading.row, "refuse 0 0 2,4,5 E_MOSTLY_BAD:1,W_SHORT_LINE:3");
  EXPECT_EQ(reading.cell.samples(), 0u);
}

// As a table whose first column is the cell: each line reads as a sample, and all but the first have its id.
TEST(SwcReader, ATableThatLosesNearlyEveryLineIsRefused) {
  std::string table = "16, 1, 0, 0, 0, 0, -1\n";
  for (int i = 0; i < 9; ++i) table += "16, 2, 1, 20, 20, 30, 0\n";
  EXPECT_EQ(read(table).report.severity, Severity::kWarn) << "a tenth is kept";
  const Reading reading = read(table + "16, 2, 1, 20, 20, 30, 0\n");
  EXPECT_EQ(reading.report.codes[InputCode::E_MOSTLY_BAD], 1u);
  EXPECT_EQ(reading.cell.samples(), 0u);
}

TEST(SwcReader, StrictRefusesOnAnyWarning) {
  EXPECT_EQ(row(withLine("3 3 0 12 0 0 2"), {.strict = true}), "refuse 0 0 - W_ZERO_RADIUS:1");
  EXPECT_EQ(row(withLine("3 3 0 12 0 1 2"), {.strict = true}), "accept 3 2 - -");
}

TEST(SwcReader, RecordsNameLineAndTokenEscapedAndCut) {
  const Reading reading = read(withLine("3 3 0 \x1B[31m 0 1 2") + "4 3 0 " + std::string(90, 'a') + " 0 1 2\n");
  ASSERT_EQ(reading.report.records.size(), 2u);
  EXPECT_EQ(reading.report.records[0].token, "\\x1b[31m");
  EXPECT_EQ(reading.report.records[1].line, 4u);
  EXPECT_EQ(reading.report.records[1].token, std::string(40, 'a') + "...");
}

TEST(SwcReader, CountsStayExactWhenRecordsAreCapped) {
  std::string text;
  for (int i = 1; i <= 1000; ++i) text += std::to_string(i) + " 3 0 0 " + (i % 3 == 0 ? "nan" : "0") + " 0 -1\n";
  const Reading reading = read(text);
  EXPECT_EQ(reading.report.codes[InputCode::W_ZERO_RADIUS], 667u);
  EXPECT_EQ(reading.report.codes[InputCode::W_NONFINITE], 333u);
  EXPECT_EQ(reading.report.dropped_lines, 333u);
  EXPECT_EQ(reading.report.records.size(), 333u + InputReport::kTokensKept);
}

TEST(SwcReader, AVeryDeepCellWrittenBackwardsIsRead) {
  std::string text;
  const int samples = 100000;
  for (int i = samples; i > 1; --i)
    text += std::to_string(i) + " 3 0 " + std::to_string(i) + " 0 1 " + std::to_string(i - 1) + "\n";
  EXPECT_EQ(row(text + "1 1 0 0 0 1 -1\n"), "warn 100000 99999 - W_ORDER:99999");
  EXPECT_EQ(row(text + "1 1 0 0 0 1 100000\n"), "warn 100000 99999 - W_CYCLE:1,W_ORDER:99998");
}

TEST(SwcReader, AUnitThatIsNoneIsRefused) {
  for (const double unit_um : {0.0, -1.0, std::nan(""), HUGE_VAL})
    EXPECT_THROW(SwcReader({.unit_um = unit_um}), UsageError);
}

// Awkward pieces in random order. Every division into blocks must read the same, and the counts must agree (finish()
// checks this).
TEST(SwcReader, BlocksMayBeCutAnywhere) {
  static const std::string kPieces[] = {"1 1 0 0 0 5 -1\n",
                                        "2 3 0 6 0 1 1\r\n",
                                        "3 3 0 7 0 1 2\r",
                                        "4 3 nan 8 0 1 3\n",
                                        "5,3,0,9,0,1,3\n",
                                        "2 2 0 1 0 1 1\n",
                                        "\n",
                                        "\r\n",
                                        "# comment\n",
                                        "#" + std::string(70000, 'x') + "\n",
                                        std::string(66000, ' ') + "# c\n",
                                        std::string(66000, '7') + "\n",
                                        "# n\0l\r\n"s,
                                        "6 3 0 1 0 1 7\n",
                                        "7 3 0 1 0 1 6\n",
                                        "8 3 0 1 0 1 8",
                                        "oops\n",
                                        "9 x 0 1 0 -1 none\n",
                                        "# OFFSET 1 2 3\n"};
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937_64 random(seed);
    std::string text = seed % 3 == 0 ? "\xEF\xBB\xBF" : "";
    for (int i = 0; i < 25; ++i) text += kPieces[random() % std::size(kPieces)];
    const Reading whole = read(text);
    SwcReader reader;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t size = random() % 4 == 0 ? 1 + random() % 40000 : 1 + random() % 5;
      reader.feed(std::string_view(text).substr(at, size));
      at += size;
    }
    Cell cell;
    EXPECT_EQ(rowOf(reader.finish("test.swc", cell)), whole.row);
    EXPECT_EQ(cell.parents, whole.cell.parents);
    EXPECT_EQ(cell.digest, whole.cell.digest);
  }
}

TEST(SwcReader, AnInputLeavesNothingToTheNext) {
  SwcReader reader;
  Cell cell;
  reader.feed("# OFFSET 1 2 3\n# unit nm\n1 1 0 0 0 5 -1\r2 3 0 6 0");
  reader.discard();
  reader.feed(withLine("3 3 0 12 0 1 2"));
  EXPECT_EQ(rowOf(reader.finish("test.swc", cell)), "accept 3 2 - -");
  reader.feed("1 1 0 0 0 0,5 -1\n");
  EXPECT_EQ(rowOf(reader.finish("test.swc", cell)), "refuse 0 0 - E_DECIMAL_COMMA:1");
  reader.feed(withLine("3 3 0 12 0 1 2"));
  EXPECT_EQ(rowOf(reader.finish("test.swc", cell)), "accept 3 2 - -");
}

TEST(SwcReader, AMissingFileIsNamed) {
  SwcReader reader;
  Cell cell;
  try {
    readSwcFile("no/such\n.swc", reader, cell);
    FAIL() << "a missing file was read";
  } catch (const IoError& error) {
    EXPECT_NE(std::string(error.what()).find("no/such\\n.swc: cannot open"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace filiform
