#include "index/anatomy/input_anatomy.h"

#include "tests/support/scenes/random_cells.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

Cell neuron(std::uint64_t seed, const std::string& source, double factor = 1) {
  Cell cell = test::randomNeuron(seed);
  cell.source = source;
  for (Vector3d& p : cell.positions_um) p *= factor;
  return cell;
}

// Findings that compare cells, as "source: kind".
std::vector<std::string> comparedOf(const InputAnatomy& anatomy) {
  std::vector<std::string> found;
  for (const CellFindings& cell : anatomy.cells())
    for (const Finding& finding : cell.findings)
      if (finding.kind == FindingKind::kOtherUnit || finding.kind == FindingKind::kDuplicate) {
        EXPECT_TRUE(finding.doubt);
        EXPECT_TRUE(cell.anyDoubt());
        found.push_back(cell.source + ": " + std::string(name(finding.kind)));
      }
  return found;
}

using ComparedCells = std::vector<std::string>;

TEST(InputAnatomy, OneFileInNanometresAmongFilesInMicrometres) {
  InputAnatomy anatomy;
  for (std::uint64_t i = 0; i < 4; ++i) anatomy.add(neuron(i, "a/" + std::to_string(i) + ".swc"));
  anatomy.add(neuron(7, "a/nm.swc", 1000));
  anatomy.add(neuron(8, "a/mm.swc", 0.001));
  anatomy.finish();
  EXPECT_EQ(comparedOf(anatomy), (ComparedCells{"a/nm.swc: other_unit", "a/mm.swc: other_unit"}));
  EXPECT_EQ(anatomy.count(FindingKind::kOtherUnit, true), 2u);
  EXPECT_EQ(anatomy.count(FindingKind::kOtherUnit, false), 0u);
}

TEST(InputAnatomy, EachFolderHasItsOwnUnitAndLargeCellsAreNone) {
  InputAnatomy anatomy;
  for (std::uint64_t i = 0; i < 4; ++i) anatomy.add(neuron(i, "um/" + std::to_string(i) + ".swc"));
  for (std::uint64_t i = 4; i < 8; ++i) anatomy.add(neuron(i, "nm/" + std::to_string(i) + ".swc", 1000));
  anatomy.add(neuron(9, "um/large.swc", 8));
  anatomy.finish();
  EXPECT_EQ(comparedOf(anatomy), ComparedCells{});
}

TEST(InputAnatomy, FlatZIsADoubtUnlessItIsTheRuleOfTheFolder) {
  const auto flat = [](std::uint64_t seed, const std::string& source) {
    Cell cell = neuron(seed, source, 5);
    for (Vector3d& p : cell.positions_um) p.z() = 7;
    return cell;
  };
  InputAnatomy anatomy;
  for (const char* source :
       {"drawings/a.swc", "drawings/b.swc", "drawings/c.swc", "stacks/one.swc", "two/a.swc", "two/b.swc"})
    anatomy.add(flat(anatomy.cells().size(), source));
  for (const char* source : {"drawings/deep.swc", "stacks/a.swc", "stacks/b.swc"})
    anatomy.add(neuron(20 + anatomy.cells().size(), source));
  anatomy.finish();
  EXPECT_EQ(anatomy.count(FindingKind::kFlatZ, true), 3u);
  EXPECT_EQ(anatomy.count(FindingKind::kFlatZ, false), 3u);
}

TEST(InputAnatomy, ACopyUnderAnotherNameIsADuplicateOfTheFirst) {
  InputAnatomy anatomy;
  anatomy.add(neuron(1, "a.swc"));
  Cell copy = neuron(1, "b/copy.swc");
  for (std::int64_t& id : copy.sample_ids) id += 10;
  copy.header = "# another header";
  anatomy.add(copy);
  Cell moved = neuron(1, "moved.swc");
  moved.positions_um.back().x() += 0.5;
  anatomy.add(moved);
  anatomy.finish();
  EXPECT_EQ(comparedOf(anatomy), (ComparedCells{"b/copy.swc: duplicate"}));
  for (const CellFindings& cell : anatomy.cells())
    for (const Finding& finding : cell.findings)
      if (finding.kind == FindingKind::kDuplicate) {
        EXPECT_TRUE(finding.text.ends_with(" a.swc")) << finding.text;
      }
}

TEST(InputAnatomy, ACopyInTheSameFileNamesTheCell) {
  InputAnatomy anatomy;
  for (const char* name : {"two/1", "two/2"}) {
    Cell cell = neuron(1, "two.swc");
    cell.name = name;
    anatomy.add(cell);
  }
  anatomy.finish();
  ASSERT_EQ(comparedOf(anatomy).size(), 1u);
  const std::vector<Finding>& findings = anatomy.cells().back().findings;
  const auto is_duplicate = [](const Finding& finding) { return finding.kind == FindingKind::kDuplicate; };
  const auto found = std::find_if(findings.begin(), findings.end(), is_duplicate);
  ASSERT_NE(found, findings.end());
  EXPECT_EQ(found->text, "the same samples and links as two.swc (cell two/1)");
}

TEST(InputAnatomy, FindingsOfOtherProcessesFollowInTheirOrder) {
  InputAnatomy whole, first, second;
  for (std::uint64_t i = 0; i < 6; ++i) {
    const Cell cell = neuron(i % 5, std::to_string(i) + ".swc", i == 2 ? 1000 : 1);
    whole.add(cell);
    (i < 3 ? first : second).add(cell);
  }
  const std::vector<std::uint8_t> bytes = second.encode();
  first.take(bytes);
  whole.finish();
  first.finish();
  ASSERT_EQ(whole.cells().size(), first.cells().size());
  for (std::size_t i = 0; i < whole.cells().size(); ++i) {
    EXPECT_EQ(whole.cells()[i].source, first.cells()[i].source);
    ASSERT_EQ(whole.cells()[i].findings.size(), first.cells()[i].findings.size());
    for (std::size_t f = 0; f < whole.cells()[i].findings.size(); ++f) {
      EXPECT_EQ(whole.cells()[i].findings[f].text, first.cells()[i].findings[f].text);
      EXPECT_EQ(placesText(whole.cells()[i].findings[f], 9), placesText(first.cells()[i].findings[f], 9));
    }
  }
  EXPECT_EQ(comparedOf(first), (ComparedCells{"2.swc: other_unit", "5.swc: duplicate"}));
}

}  // namespace
}  // namespace filiform
