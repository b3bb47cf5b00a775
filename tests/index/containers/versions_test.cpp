#include "index/containers/versions.h"

#include "index/input/input.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

// The paths that stay.
std::vector<std::string> kept(const std::vector<std::string_view>& paths, MorphologyVersion wanted) {
  const std::vector<bool> left_out = versionsLeftOut(paths, wanted);
  std::vector<std::string> stay;
  for (std::size_t i = 0; i < paths.size(); ++i)
    if (!left_out[i]) stay.emplace_back(paths[i]);
  return stay;
}

using Paths = std::vector<std::string>;

TEST(Versions, OneOfAPairStaysWhateverTheLettersCase) {
  const std::vector<std::string_view> paths = {"lab/CNG version/n1.CNG.swc", "lab/Source-Version/n1.swc",
                                               "lab/SOURCE-VERSION/N2.ASC", "lab/cng VERSION/n2.cng.SWC"};
  EXPECT_EQ(kept(paths, MorphologyVersion::cng), (Paths{"lab/CNG version/n1.CNG.swc", "lab/cng VERSION/n2.cng.SWC"}));
  EXPECT_EQ(kept(paths, MorphologyVersion::source), (Paths{"lab/Source-Version/n1.swc", "lab/SOURCE-VERSION/N2.ASC"}));
  EXPECT_EQ(kept(paths, MorphologyVersion::both).size(), 4u);
}

TEST(Versions, WhatHasNoPartnerStays) {
  const std::vector<std::string_view> paths = {"CNG version/a.CNG.swc", "Source-Version/b.swc", "c.swc"};
  EXPECT_EQ(kept(paths, MorphologyVersion::cng).size(), 3u);
  EXPECT_EQ(kept(paths, MorphologyVersion::source).size(), 3u);
}

TEST(Versions, NeuronsOfEqualNameInOtherArchivesAreNoPartners) {
  const std::vector<std::string_view> paths = {"one/CNG version/a.CNG.swc", "two/Source-Version/a.swc"};
  EXPECT_EQ(kept(paths, MorphologyVersion::cng).size(), 2u);
}

TEST(Versions, PairsInOneFolderAndOneLevelApartAreRecognised) {
  EXPECT_EQ(kept({"a.CNG.swc", "a.swc"}, MorphologyVersion::cng), (Paths{"a.CNG.swc"}));
  EXPECT_EQ(kept({"x/a.CNG.swc", "x/source/a.swc"}, MorphologyVersion::cng), (Paths{"x/a.CNG.swc"}));
  EXPECT_EQ(kept({"x/cng/a.CNG.swc", "x/a.swc"}, MorphologyVersion::source), (Paths{"x/a.swc"}));
}

TEST(Versions, AnAscBesideTheSwcOfItsNameIsLeftOut) {
  EXPECT_EQ(kept({"a.asc", "a.swc", "b.asc"}, MorphologyVersion::cng), (Paths{"a.swc", "b.asc"}));
  EXPECT_EQ(kept({"m/asc/a.asc", "m/swc/a.swc"}, MorphologyVersion::cng), (Paths{"m/swc/a.swc"}));
  EXPECT_EQ(kept({"m/one/a.asc", "m/two/a.swc"}, MorphologyVersion::cng).size(), 2u);
  EXPECT_EQ(kept({"a.asc", "a.swc"}, MorphologyVersion::both).size(), 2u);
}

TEST(Versions, AnH5BesideTheSwcOrAscOfItsNameIsLeftOut) {
  EXPECT_EQ(kept({"a.asc", "a.h5", "b.h5", "b.swc", "c.h5"}, MorphologyVersion::cng),
            (Paths{"a.asc", "b.swc", "c.h5"}));
  EXPECT_EQ(kept({"m/asc/a.asc", "m/h5/a.h5", "m/swc/a.swc"}, MorphologyVersion::cng), (Paths{"m/swc/a.swc"}));
  EXPECT_EQ(kept({"m/h5v1/a.h5", "m/ascii/a.asc", "m/swc/a.swc"}, MorphologyVersion::cng),
            (Paths{"m/ascii/a.asc", "m/swc/a.swc"}));
  EXPECT_EQ(kept({"a.h5", "a.swc"}, MorphologyVersion::both).size(), 2u);
}

const std::string kNeuron = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n";

test::ZipMember memberOf(const std::string& name) {
  test::ZipMember member;
  member.name = name;
  member.content = kNeuron;
  return member;
}

std::vector<std::string> chosenSources(const std::string& path, MorphologyVersion versions,
                                       InputTotals* sums = nullptr) {
  InputOptions options;
  options.versions = versions;
  options.swc.strict = true;  // a choice is no fault
  Input input({path}, options);
  std::vector<std::string> sources;
  for (Cell cell; input.next(cell);) sources.push_back(cell.source);
  if (sums != nullptr) *sums = totals(input.reports());
  return sources;
}

TEST(Versions, AnArchiveGivesEachNeuronOnceAndCountsTheOther) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("lab.zip"),
                   test::buildZip({memberOf("Lab/CNG version/n.CNG.swc"), memberOf("Lab/Source-Version/n.swc"),
                                   memberOf("Lab/Source-Version/alone.swc")}));
  InputTotals sums;
  EXPECT_EQ(chosenSources(folder.file("lab.zip"), MorphologyVersion::cng, &sums),
            (Paths{"lab.zip/Lab/CNG version/n.CNG.swc", "lab.zip/Lab/Source-Version/alone.swc"}));
  EXPECT_EQ(sums.codes[InputCode::OTHER_VERSION], 1u);
  EXPECT_EQ(sums.skipped, 1u);
  EXPECT_EQ(sums.refused, 0u);
  EXPECT_EQ(chosenSources(folder.file("lab.zip"), MorphologyVersion::source),
            (Paths{"lab.zip/Lab/Source-Version/alone.swc", "lab.zip/Lab/Source-Version/n.swc"}));
  EXPECT_EQ(chosenSources(folder.file("lab.zip"), MorphologyVersion::both).size(), 3u);
}

TEST(Versions, AnUnpackedArchiveIsReadAsThePackedOne) {
  const test::TempFolder folder;
  std::filesystem::create_directories(folder.file("Lab/CNG version"));
  std::filesystem::create_directories(folder.file("Lab/Source-Version"));
  test::writeBytes(folder.file("Lab/CNG version/n.CNG.swc"), kNeuron);
  test::writeBytes(folder.file("Lab/Source-Version/n.swc"), kNeuron);
  InputTotals sums;
  EXPECT_EQ(chosenSources(folder.path(), MorphologyVersion::cng, &sums), (Paths{"Lab/CNG version/n.CNG.swc"}));
  EXPECT_EQ(sums.skipped, 1u);
  EXPECT_EQ(sums.codes[InputCode::OTHER_VERSION], 1u);
  EXPECT_EQ(chosenSources(folder.path(), MorphologyVersion::source), (Paths{"Lab/Source-Version/n.swc"}));
}

}  // namespace
}  // namespace filiform
