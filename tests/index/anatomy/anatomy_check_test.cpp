#include "index/anatomy/anatomy_check.h"

#include "index/formats/swc.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// A soma, a dendrite and an axon that wind in space, with `steps` samples each. Radii vary.
struct Drawing {
  int steps = 30;
  double step_um = 3, x_um = 0, y_um = 0, z_scale = 1;
  std::string soma = "1 1 X Y 0 6 -1\n";
  int dendrite = 3, axon = 2;

  std::string text() const {
    std::string out = soma;
    int id = 2;
    for (const auto& [type, way] : {std::pair(dendrite, 1.0), std::pair(axon, -1.0)}) {
      int parent = soma.empty() ? -1 : 1;
      for (int i = 1; i <= steps; ++i, parent = id - 1)
        out += std::to_string(id++) + " " + std::to_string(type) + " " +
               std::to_string(x_um + way * (6 + 0.8 * step_um * i)) + " " +
               std::to_string(y_um + 0.6 * step_um * i + std::sin(i) * 0.3) + " " +
               std::to_string(z_scale * (0.5 * step_um * i + std::cos(i) * 0.3)) + " " + std::to_string(1 + 0.01 * i) +
               " " + std::to_string(parent) + "\n";
    }
    for (const auto& [letter, value] : {std::pair('X', x_um), std::pair('Y', y_um)})
      if (const std::size_t at = out.find(letter); at != std::string::npos) out.replace(at, 1, std::to_string(value));
    return out;
  }
};

std::vector<Finding> findingsOf(const std::string& text) {
  Cell cell;
  EXPECT_NE(readSwc(text, "cell.swc", {}, cell).severity, Severity::kRefuse) << text;
  AnatomyCheck check;
  return check.of(cell);
}

// "long_links! flat_z": a doubt has a mark.
std::string kindsOf(const std::string& text) {
  std::string kinds;
  for (const Finding& finding : findingsOf(text)) {
    EXPECT_FALSE(finding.text.empty());
    EXPECT_LE(finding.places.size(), Finding::kMostPlaces);
    kinds += (kinds.empty() ? "" : " ") + std::string(name(finding.kind)) + (finding.doubt ? "!" : "");
  }
  return kinds;
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

const std::string kGoodCell = Drawing().text();

TEST(AnatomyCheck, HasNothingToSayOfAGoodCell) {
  EXPECT_EQ(kindsOf(kGoodCell), "");
  EXPECT_EQ(kindsOf("# header\n" + Drawing{.steps = 2000, .step_um = 0.7}.text()), "");
  EXPECT_EQ(kindsOf(Drawing{.x_um = 5e4, .y_um = -3e4}.text()), "");
  EXPECT_EQ(kindsOf("1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n"), "");
  EXPECT_EQ(kindsOf("1 1 0 0 0 5 -1\n"), "");
  EXPECT_EQ(kindsOf("1 1 0 0 0 5 -1\n2 3 10 0 0 1 1\n3 3 20 0 0 1 2\n4 3 30 5 0 1 3\n"), "");
  // Three points of a soma, and a neurite that begins on its surface.
  EXPECT_EQ(kindsOf(Drawing{.soma = "1 1 0 0 0 6 -1\n100 1 0 -6 0 6 1\n101 1 0 6 0 6 1\n"}.text()), "");
  // The centre of a soma is as far from a fine neurite as its radius.
  EXPECT_EQ(kindsOf(Drawing{.steps = 300, .step_um = 0.1}.text()), "");
}

TEST(AnatomyCheck, ALinkFarLongerThanTheMedianIsADoubtWithItsLineAndLength) {
  const std::string jump = kGoodCell + "900 2 1000 0 9 1 61\n901 2 1002 2 10 1.2 900\n";
  const std::vector<Finding> findings = findingsOf(jump);
  ASSERT_EQ(kindsOf(jump), "long_links!");
  EXPECT_EQ(findings[0].count, 1u);
  ASSERT_EQ(findings[0].places.size(), 1u);
  EXPECT_EQ(findings[0].places[0].line, 62u);
  EXPECT_EQ(findings[0].places[0].sample, 900);
  EXPECT_NEAR(findings[0].places[0].value_um, 1080, 10);
  EXPECT_EQ(placesText(findings[0], 3).substr(0, 10), "line 62 (1");
  // Below 100 um and below a twentieth of the length it is a note; above the twentieth a doubt.
  EXPECT_EQ(kindsOf(Drawing{.steps = 800, .step_um = 2}.text() + "5000 3 -60 -30 -10 1 1\n"), "long_links");
  EXPECT_EQ(kindsOf(Drawing{.steps = 40, .step_um = 2}.text() + "5000 3 -60 -30 -10 1 1\n"), "long_links!");
}

TEST(AnatomyCheck, OnlyTheLongestLinksAreListedAndAllAreCounted) {
  std::string text = Drawing{.steps = 300}.text();
  for (int i = 0; i < 50; ++i) text += std::to_string(2000 + i) + " 3 " + std::to_string(300 + i) + " 20 10 1 1\n";
  const std::vector<Finding> findings = findingsOf(text);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].count, 50u);
  EXPECT_EQ(findings[0].places.size(), Finding::kMostPlaces);
  EXPECT_EQ(findings[0].places[0].sample, 2049);
  EXPECT_TRUE(placesText(findings[0], 2).ends_with(" and 48 more")) << placesText(findings[0], 2);
}

TEST(AnatomyCheck, TreesAndSomata) {
  EXPECT_EQ(kindsOf(kGoodCell + "900 3 30 -30 9 1 -1\n901 3 33 -31 10 1.1 900\n"), "loose_trees");
  EXPECT_EQ(findingsOf(kGoodCell + "900 3 30 -30 9 1 -1\n")[0].places[0].line, 62u);
  const std::string no_soma = Drawing{.soma = ""}.text();
  EXPECT_EQ(kindsOf(no_soma), "loose_trees no_soma");  // the axon is not joined to the dendrite
  std::string one_tree = no_soma;
  one_tree.replace(one_tree.rfind(" -1\n"), 4, " 2\n");
  EXPECT_EQ(kindsOf(one_tree), "no_soma");
  EXPECT_EQ(kindsOf(kGoodCell + "900 1 40 -30 9 6 -1\n901 3 43 -31 10 1.1 900\n"), "several_somata");
  // Parents that come later do not make another tree.
  EXPECT_EQ(kindsOf("999 3 4 -9 1 1.5 1\n" + kGoodCell), "");
}

TEST(AnatomyCheck, TypesThatTellNothing) {
  EXPECT_EQ(kindsOf(Drawing{.dendrite = 0, .axon = 0}.text()), "one_type");
  EXPECT_EQ(kindsOf(replaced(Drawing{.dendrite = 3, .axon = 3}.text(), "1 1 ", "1 3 ")), "no_soma one_type");
  EXPECT_EQ(kindsOf(Drawing{.dendrite = 3, .axon = 3}.text()), "");
}

TEST(AnatomyCheck, FlatOrScaledZ) {
  EXPECT_EQ(kindsOf(Drawing{.z_scale = 0}.text()), "flat_z");
  EXPECT_EQ(kindsOf(Drawing{.steps = 120, .z_scale = 0}.text()), "flat_z!");
  EXPECT_EQ(kindsOf(Drawing{.z_scale = 20}.text()), "z_scale");
  EXPECT_EQ(kindsOf(Drawing{.z_scale = 0.05}.text()), "z_scale");
}

TEST(AnatomyCheck, AnAxonThatBeginsFarFromTheSoma) {
  const std::string far = replaced(Drawing{.steps = 120}.text(), "\n100 3 ", "\n100 2 ");
  EXPECT_EQ(kindsOf(far), "far_axon");
  EXPECT_EQ(findingsOf(far)[0].places[0].line, 100u);
  EXPECT_EQ(kindsOf(replaced(Drawing{.steps = 120}.text(), "\n20 3 ", "\n20 2 ")), "");
}

TEST(AnatomyCheck, RepeatedPointsAndTurns) {
  EXPECT_EQ(kindsOf(kGoodCell + "900 3 5 5 5 1 1\n901 3 5 5 5 1 900\n"), "zero_length");
  const std::string back = kGoodCell + "900 3 -50 9 9 1 1\n901 3 -40 9 9 1 900\n902 3 -49 9 9.5 1 901\n";
  ASSERT_EQ(kindsOf(back), "back_tracking");
  EXPECT_EQ(findingsOf(back)[0].places[0].sample, 901);
}

TEST(AnatomyCheck, RadiiThatAreConstantUnknownOrLargerThanTheCell) {
  std::string constant = "1 1 0 0 0 6 -1\n", unknown = constant;
  for (int i = 2; i < 20; ++i) {
    const std::string at = " " + std::to_string(6 + 3 * i) + " " + std::to_string(i * i % 7) + " " +
                           std::to_string(i * i % 5) + " ",
                      parent = " " + std::to_string(i - 1) + "\n";
    constant += std::to_string(i) + " 3" + at + "1" + parent;
    unknown += std::to_string(i) + " 3" + at + (i % 2 == 0 ? "NaN" : i % 3 == 0 ? "0" : std::to_string(i)) + parent;
  }
  EXPECT_EQ(kindsOf(constant), "constant_radius");
  EXPECT_EQ(kindsOf(unknown), "unknown_radius");
  EXPECT_EQ(kindsOf(kGoodCell + "900 3 5 9 5 9000 1\n"), "large_radius");
}

TEST(AnatomyCheck, AGraphHasLinksTreesAndShapeOnly) {
  Cell cell;
  for (int i = 0; i < 40; ++i) {
    cell.sample_ids.push_back(i + 1);
    cell.positions_um.emplace_back(3 * i, 2 * std::sin(i), std::cos(i));
    cell.radii_um.push_back(1.0f + 0.1f * static_cast<float>(i));
    cell.types.push_back(static_cast<std::uint16_t>(3 + i % 2));
  }
  std::vector<std::array<std::uint32_t, 2>> edges;
  for (std::uint32_t i = 0; i < 38; ++i) edges.push_back({i, i + 1});
  edges.push_back({0, 38});
  connect(cell, edges);
  ASSERT_TRUE(cell.isGraph());
  AnatomyCheck check;
  std::string kinds;
  for (const Finding& finding : check.of(cell)) kinds += std::string(name(finding.kind)) + " ";
  EXPECT_EQ(kinds, "long_links loose_trees ");
}

TEST(AnatomyCheck, EachKindHasANameAndASentence) {
  for (std::size_t i = 0; i < kFindingKinds; ++i) {
    const auto kind = static_cast<FindingKind>(i);
    EXPECT_FALSE(name(kind).empty());
    EXPECT_FALSE(explanation(kind).empty());
    EXPECT_FALSE(nextStep(kind).ends_with('.'));
  }
}

}  // namespace
}  // namespace filiform
