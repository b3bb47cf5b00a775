// filiform check as users run it: text, TSV, JSON and exit code give the same verdict on every input.
#include "index/input/input.h"
#include "tests/support/corpus.h"
#include "tests/support/process.h"
#include "tests/support/sanitized.h"
#include "tests/support/temp_folder.h"
#include "tests/support/zip_builder.h"

#include <cctype>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace filiform {
namespace {

namespace fs = std::filesystem;
using test::Outcome;
using test::runFiliform;

const std::string kTwoSamples = "1 1 0 0 0 5 -1\n2 3 0 6 0 1 1\n";

test::ZipMember zipMember(const std::string& name, const std::string& content) {
  test::ZipMember m;
  m.name = name;
  m.content = content;
  return m;
}

// The number before a word in the first line of the text, with blanks between thousands: "1 with warnings".
std::uint64_t countBefore(const std::string& text, const std::string& word) {
  const std::string line = text.substr(0, text.find('\n'));
  const std::size_t end = line.find(" " + word);
  if (end == std::string::npos) return 0;
  std::string digits;
  for (std::size_t i = end; i-- > 0 && (std::isdigit(static_cast<unsigned char>(line[i])) != 0 || line[i] == ' ');)
    if (line[i] != ' ') digits.insert(digits.begin(), line[i]);
  return std::stoull(digits);
}

// Runs check on one input in its three forms and compares them. Returns the verdict.
std::string verdictOn(const std::string& path, const std::vector<std::string>& options = {}) {
  SCOPED_TRACE(path);
  const auto checked = [&](const std::string& form) {
    std::vector<std::string> arguments = {"check", path};
    if (!form.empty()) arguments.push_back(form);
    arguments.insert(arguments.end(), options.begin(), options.end());
    return runFiliform(arguments);
  };
  const Outcome text = checked(""), tsv = checked("--tsv"), json = checked("--json");
  EXPECT_EQ(text.exit_code, tsv.exit_code);
  EXPECT_EQ(text.exit_code, json.exit_code);
  std::istringstream rows(tsv.out);
  std::string row, file, severity;
  std::getline(rows, row);
  std::getline(rows, file, '\t');
  std::getline(rows, severity, '\t');
  EXPECT_EQ(text.exit_code, severity == "refuse" ? 1 : 0);

  const auto object = nlohmann::json::parse(json.out, nullptr, false);
  if (object.is_discarded()) {
    ADD_FAILURE() << json.out;
    return severity;
  }
  EXPECT_EQ(object.at("verdict"), severity);
  EXPECT_EQ(object.at("files").at(0).at("severity"), severity);

  EXPECT_EQ(countBefore(text.out, "refused") > 0, severity == "refuse") << text.out;
  EXPECT_EQ(text.out.find("\n  refused ") != std::string::npos, severity == "refuse") << text.out;
  // Other versions count as skipped, but are a note: told in one line, and no warning.
  const std::uint64_t others = object.at("codes").value("OTHER_VERSION", std::uint64_t{0});
  EXPECT_EQ(text.out.find("\n  OTHER_VERSION " + std::to_string(others) + ": ") != std::string::npos, others > 0)
      << text.out;
  EXPECT_EQ(text.out.find("\n  skipped ") != std::string::npos, countBefore(text.out, "skipped") > others) << text.out;
  for (const char* key : {"accepted", "skipped", "refused"}) EXPECT_EQ(object.at(key), countBefore(text.out, key));
  EXPECT_EQ(object.at("warned"), countBefore(text.out, "with warnings"));
  const bool all_accepted = object.at("warned") == 0 && object.at("skipped") == others && object.at("refused") == 0;
  EXPECT_EQ(all_accepted, severity == "accept");
  return severity;
}

TEST(Check, AZipWithAReadableEntryAndAnInnerZipIsAWarning) {
  const test::TempFolder folder;
  const std::string inner = test::buildZip({zipMember("b.swc", kTwoSamples)});
  const std::string archive = folder.file("outer.zip");
  test::writeBytes(archive, test::buildZip({zipMember("a.swc", kTwoSamples), zipMember("inner.zip", inner)}));
  EXPECT_EQ(verdictOn(archive), "warn");
  EXPECT_EQ(verdictOn(archive, {"--strict"}), "refuse");
  const std::string text = runFiliform({"check", archive}).out;
  EXPECT_EQ(text.substr(0, text.find(';')), "2 inputs: 1 accepted, 0 with warnings, 1 skipped, 0 refused");
  EXPECT_NE(text.find("  skipped outer.zip/inner.zip: archive inside the archive; not opened (W_ZIP_NESTED)"),
            std::string::npos)
      << text;
}

TEST(Check, OneVerdictOnMadeUpArchives) {
  const test::TempFolder folder;
  test::ZipMember rotten = zipMember("rotten.swc", kTwoSamples), link = zipMember("link.swc", "/etc/passwd");
  rotten.crc32 = 1;
  link.attributes = test::kSymbolicLinkAttributes;
  const test::ZipMember good = zipMember("good.swc", kTwoSamples), empty = zipMember("empty.swc", ""),
                        nested = zipMember("in.zip", test::buildZip({good})), climbing = zipMember("../c.swc", "x"),
                        zero = zipMember("zero.swc", "1 1 0 0 0 0 -1\n");
  const std::vector<std::pair<std::vector<test::ZipMember>, std::string>> archives = {
      {{good}, "accept"},
      {{good, nested}, "warn"},
      {{good, rotten}, "warn"},
      {{good, link}, "warn"},
      {{good, empty}, "warn"},
      {{good, climbing, rotten, nested}, "warn"},
      {{zero}, "warn"},
      {{zero, nested}, "warn"},
      {{good, good}, "warn"},
      {{nested}, "refuse"},
      {{rotten}, "refuse"},
      {{rotten, nested}, "refuse"},
      {{link, climbing}, "refuse"},
      {{empty}, "refuse"},
      {{}, "refuse"},
  };
  for (std::size_t i = 0; i < archives.size(); ++i) {
    const std::string path = folder.file("archive" + std::to_string(i) + ".zip");
    test::writeBytes(path, test::buildZip(archives[i].first));
    const std::string& want = archives[i].second;
    EXPECT_EQ(verdictOn(path), want) << i;
    EXPECT_EQ(verdictOn(path, {"--strict"}), want == "accept" ? "accept" : "refuse") << i;
  }
}

TEST(Check, OneVerdictOnEveryMalformedFile) {
  FILIFORM_NEEDS_CORPUS();
  const fs::path folder = *test::corpusFolder() / "malformed";
  std::ifstream expected(folder / "expected.tsv");
  std::string line;
  std::size_t files = 0;
  for (std::getline(expected, line); std::getline(expected, line); ++files) {
    if (test::kSanitized && files % 4 != 0)
      continue;  // three processes of the program each; the preset plain reads all
    std::istringstream columns(line);
    std::string file, severity;
    std::getline(columns, file, '\t');
    std::getline(columns, severity, '\t');
    EXPECT_EQ(verdictOn((folder / file).string()), severity) << file;
  }
  EXPECT_EQ(files, 89u);
}

TEST(Check, JsonHoldsTheFieldsOfTheTableAndCounts) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.swc"), "1 1 0 0 0 0 -1\n2 3 0 nan 0 1 1\n3 3 0 9 0 1 1\n");
  const Outcome outcome = runFiliform({"check", folder.file("a.swc"), "--json"});
  EXPECT_EQ(outcome.exit_code, 0);
  const auto object = nlohmann::json::parse(outcome.out);
  const auto& file = object.at("files").at(0);
  EXPECT_EQ(file.at("file"), "a.swc");
  EXPECT_EQ(file.at("severity"), "warn");
  EXPECT_EQ(file.at("samples"), 2);
  EXPECT_EQ(file.at("segments"), 1);
  EXPECT_EQ(file.at("dropped"), "2");
  EXPECT_EQ(file.at("codes"), (nlohmann::json{{"W_NONFINITE", 1}, {"W_ZERO_RADIUS", 1}}));
  EXPECT_EQ(object.at("samples"), 2);
  EXPECT_EQ(object.at("inputs"), 1);
  EXPECT_EQ(object.at("codes"), file.at("codes"));
  EXPECT_EQ(runFiliform({"check", folder.file("a.swc"), "--json", "--tsv"}).exit_code, 2);
}

TEST(Check, ListsWhatIsKeptOddlyWithItsLine) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.swc"), "1 1 0 0 0 x -1\n2 3 9 0 0 1 3\n3 3 9 9 0 1 2\n2 3 1 1 1 1 1\n");
  const Outcome outcome = runFiliform({"check", folder.file("a.swc"), "--json", "--report", folder.file("r.json")});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto files = nlohmann::json::parse(outcome.out).at("files");
  EXPECT_EQ(files, nlohmann::json::parse(test::readBytes(folder.file("r.json"))));
  EXPECT_EQ(files.at(0).at("fate"), "warned");
  std::string said;
  for (const auto& record : files.at(0).at("records"))
    said += record.at("line").dump() + ' ' + record.at("code").get<std::string>() + ' ' +
            record.at("effect").get<std::string>() + '\n';
  EXPECT_EQ(said, "1 W_BAD_RADIUS kept\n2 W_CYCLE cut\n4 W_DUP_ID dropped\n");
  const Outcome text = runFiliform({"check", folder.file("a.swc")});
  EXPECT_NE(text.out.find("(first: a.swc:1)\n"), std::string::npos) << text.out;
  const Outcome piped = runFiliform({"check", folder.file("a.swc"), "--report", "-"});
  EXPECT_EQ(nlohmann::json::parse(piped.out), files);
  EXPECT_EQ(piped.err, text.out);
}

TEST(Check, AThreePointSomaThatIsOffIsARemarkOnly) {
  const test::TempFolder folder;
  const std::string rest = "4 3 9 0 0 1 1\n5 3 14 0 0 1 4\n";
  test::writeBytes(folder.file("good.swc"), "1 1 0 0 0 4 -1\n2 1 0 -4 0 4 1\n3 1 0 4.02 0 4 1\n" + rest);
  test::writeBytes(folder.file("off.swc"), "1 1 0 0 0 4 -1\n2 1 0 -4 0 4 1\n3 1 0 4.6 0 4 1\n" + rest);
  const Outcome text = runFiliform({"check", folder.path(), "--strict"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_NE(text.out.find("2 inputs: 2 accepted"), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("  soma_three_point_off 1: "), std::string::npos) << text.out;
  EXPECT_NE(text.out.find("off.swc"), std::string::npos) << text.out;
  const auto object = nlohmann::json::parse(runFiliform({"check", folder.path(), "--json"}).out);
  EXPECT_EQ(object.at("soma_three_point_off"), nlohmann::json::array({"off.swc"}));
  EXPECT_EQ(object.at("verdict"), "accept");
  EXPECT_EQ(runFiliform({"check", folder.path(), "--tsv"}).out,
            "file\tseverity\tsamples\tsegments\tdropped\tcodes\n"
            "good.swc\taccept\t5\t4\t-\t-\noff.swc\taccept\t5\t4\t-\t-\n");
}

// A soma, and a dendrite that winds in space.
std::string windingText(int steps, double scale = 1) {
  std::string text = "1 1 0 0 0 " + std::to_string(5 * scale) + " -1\n";
  for (int i = 1; i <= steps; ++i)
    text += std::to_string(i + 1) + " 3 " + std::to_string(scale * (5 + 2 * i)) + " " +
            std::to_string(scale * (i % 7)) + " " + std::to_string(scale * (i % 5)) + " " +
            std::to_string(scale * (1 + 0.01 * i)) + " " + std::to_string(i) + "\n";
  return text;
}
const std::string kJump = "900 2 900 0 9 1 1\n901 2 903 1 9 1.5 900\n";

TEST(Check, AGoodCellDrawsNoDoubtAndNoNote) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("good.swc"), windingText(80));
  const Outcome text = runFiliform({"check", folder.file("good.swc")});
  EXPECT_EQ(text.out, "1 input: 1 accepted, 0 with warnings, 0 refused; 81 samples, 80 segments kept\n");
  EXPECT_EQ(runFiliform({"check", folder.file("good.swc"), "--profile", "strict"}).exit_code, 0);
  const auto object = nlohmann::json::parse(runFiliform({"check", folder.file("good.swc"), "--json"}).out);
  EXPECT_TRUE(object.at("anatomy").empty());
  EXPECT_TRUE(object.at("files").at(0).at("anatomy").empty());
}

TEST(Check, NamesEachDoubtWithItsLinesAndWhatToDoNext) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("jump.swc"), "# a header\n" + windingText(80) + kJump);
  test::writeBytes(folder.file("good.swc"), windingText(90));
  test::writeBytes(folder.file("good (copy).swc"), "# copied\r\n" + windingText(90));
  test::writeBytes(folder.file("nm.swc"), windingText(70, 1000));
  const Outcome text = runFiliform({"check", folder.path()});
  EXPECT_EQ(text.exit_code, 0);
  for (const char* line : {"  doubt good.swc: duplicate: the same samples and links as good (copy).swc\n    next: ",
                           "  doubt jump.swc: long_links: 1 link longer than 20 times the median of ",
                           " (line 83 (895 um))\n    next: look at these lines", "  doubt nm.swc: other_unit: about "})
    EXPECT_NE(text.out.find(line), std::string::npos) << line << "\n" << text.out;
  EXPECT_NE(text.out.find("  note far_axon 1: "), std::string::npos) << text.out;

  const auto object = nlohmann::json::parse(runFiliform({"check", folder.path(), "--json"}).out);
  EXPECT_EQ(object.at("verdict"), "accept");
  EXPECT_EQ(object.at("anatomy").at("long_links"), (nlohmann::json{{"doubts", 1}, {"notes", 0}}));
  for (const auto& file : object.at("files")) {
    if (file.at("file") != "jump.swc") continue;
    const auto& finding = file.at("anatomy").at(0).at("findings").at(0);
    EXPECT_EQ(finding.at("finding"), "long_links");
    EXPECT_EQ(finding.at("class"), "doubt");
    EXPECT_EQ(finding.at("places").at(0).at("line"), 83);
    EXPECT_EQ(finding.at("places").at(0).at("sample"), 900);
    EXPECT_FALSE(finding.at("next").get<std::string>().empty());
  }
  // Only the profile strict refuses for doubts.
  EXPECT_EQ(runFiliform({"check", folder.path(), "--strict"}).exit_code, 0);
  const Outcome strict = runFiliform({"check", folder.path(), "--profile", "strict"});
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_NE(strict.out.find("refused jump.swc: refused for its doubts, because of --profile strict: long_links\n"),
            std::string::npos)
      << strict.out;
  EXPECT_EQ(strict.out.substr(0, strict.out.find(';')), "4 inputs: 1 accepted, 0 with warnings, 3 refused");
}

TEST(Check, TheProfileChoosesWhatRefuses) {
  const test::TempFolder folder;
  test::writeBelow(folder, "a/good.swc", windingText(80));
  test::writeBelow(folder, "a/empty.swc", "");
  test::writeBytes(folder.file("empty.swc"), "");
  test::writeBytes(folder.file("zero.swc"), "1 1 0 0 0 0 -1\n");
  const auto code = [](const std::string& path, const std::string& profile) {
    return runFiliform({"check", path, "--profile", profile}).exit_code;
  };
  EXPECT_EQ(code(folder.file("a"), "standard"), 1);
  EXPECT_EQ(code(folder.file("a"), "lenient"), 0);
  EXPECT_EQ(code(folder.file("empty.swc"), "lenient"), 1);
  EXPECT_EQ(code(folder.file("zero.swc"), "standard"), 0);
  EXPECT_EQ(code(folder.file("zero.swc"), "strict"), 1);
  EXPECT_EQ(code(folder.file("zero.swc"), "harsh"), 2);
  test::writeBytes(folder.file("both.zip"), test::buildZip({zipMember("good.swc", windingText(80)),
                                                            zipMember("jump.swc", windingText(70) + kJump)}));
  EXPECT_EQ(code(folder.file("both.zip"), "standard"), 0);
  EXPECT_EQ(code(folder.file("both.zip"), "strict"), 1);
}

TEST(Check, FilesWithWarningsAreNamedWithTheirLines) {
  const test::TempFolder folder;
  test::writeBytes(folder.file("a.swc"), windingText(5) + "2 3 9 9 9 1 1\n3 3 9 9 9 1 1\n10 3 9 9 9 -1 1\n");
  test::writeBytes(folder.file("b.swc"), windingText(6));
  const Outcome text = runFiliform({"check", folder.path()});
  EXPECT_NE(text.out.find("  warned a.swc: W_BAD_RADIUS line 9; W_DUP_ID lines 7, 8\n"), std::string::npos) << text.out;
  EXPECT_EQ(text.out.find("warned b.swc"), std::string::npos);
}

TEST(Check, ThePageShowsTheWorstFirstAndNamesAreOnlyText) {
  const test::TempFolder folder;
  test::writeBelow(folder, "in/<img src=x onerror=alert(1)>&\"'.swc", windingText(80));
  test::writeBelow(folder, "in/jump.swc", windingText(70) + kJump);
  test::writeBelow(folder, "in/empty.swc", "");
  const Outcome outcome = runFiliform({"check", folder.file("in"), "--report", folder.file("r.html")});
  EXPECT_EQ(outcome.exit_code, 1) << outcome.err;
  const std::string page = test::readBytes(folder.file("r.html"));
  EXPECT_TRUE(page.starts_with("<!DOCTYPE html>")) << page;
  EXPECT_EQ(page.find("<img"), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
  const std::size_t empty = page.find("<h2>empty.swc"), jump = page.find("<h2>jump.swc"),
                    good = page.find("<h2>&lt;img src=x onerror=alert(1)&gt;&amp;&quot;&#39;.swc");
  ASSERT_NE(good, std::string::npos) << page;
  EXPECT_LT(empty, jump);
  EXPECT_LT(jump, good);
  EXPECT_NE(page.find("long_links: 1 link"), std::string::npos);
  std::size_t pictures = 0;
  for (std::size_t at = page.find("<svg"); at != std::string::npos; at = page.find("<svg", at + 1)) ++pictures;
  EXPECT_EQ(pictures, 2u);
}

// Samples of a cell at x, each with another radius, from an id on.
std::string cellAt(int first, double x) {
  std::string text = std::to_string(first) + " 1 " + std::to_string(x) + " 0 0 5 -1\n";
  for (int i = 1; i < 8; ++i)
    text += std::to_string(first + i) + " 3 " + std::to_string(x + 6 * i) + " " + std::to_string(i % 3) + " " +
            std::to_string(0.5 * i) + " " + std::to_string(1 + 0.1 * i) + " " + std::to_string(first + i - 1) + "\n";
  return text;
}

TEST(Check, ThePageDrawsEachCellOfAFile) {
  const test::TempFolder folder;
  test::writeBelow(folder, "in/two<b>.swc", cellAt(1, 0) + cellAt(11, 500));
  test::writeBelow(folder, "in/warned.swc", cellAt(1, 0) + "9 3 1 1 1 1 99\n");
  const Outcome outcome = runFiliform({"check", folder.file("in"), "--report", folder.file("r.html")});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string page = test::readBytes(folder.file("r.html"));
  std::size_t pictures = 0;
  for (std::size_t at = page.find("<svg"); at != std::string::npos; at = page.find("<svg", at + 1)) ++pictures;
  EXPECT_EQ(pictures, 3u);
  for (const char* name : {"<figcaption>two&lt;b&gt;/1</figcaption>", "<figcaption>two&lt;b&gt;/2</figcaption>"})
    EXPECT_NE(page.find(name), std::string::npos) << page;
}

// Arguments are named by their base name.
TEST(Check, FilesOfOneNameHaveTheirOwnFindings) {
  const test::TempFolder folder;
  test::writeBelow(folder, "a/cell.swc", windingText(70) + kJump);
  test::writeBelow(folder, "b/cell.swc", windingText(80));
  const std::string a = folder.file("a/cell.swc"), b = folder.file("b/cell.swc");
  const Outcome strict = runFiliform({"check", a, b, "--profile", "strict"});
  EXPECT_TRUE(strict.out.starts_with("2 inputs: 1 accepted, 0 with warnings, 1 refused; ")) << strict.out;
  EXPECT_EQ(runFiliform({"check", a, b, "--report", folder.file("r.html")}).exit_code, 0);
  const std::string page = test::readBytes(folder.file("r.html"));
  const std::size_t second = page.find("<h2>cell.swc", page.find("<h2>cell.swc") + 1);
  EXPECT_LT(page.find("long_links"), second) << page;
  EXPECT_EQ(page.find("long_links", second), std::string::npos) << page;
}

TEST(Check, ThePageNamesARefusedFileBeforeManyDoubts) {
  const test::TempFolder folder;
  std::string many;  // each with a link of 400 um
  for (int i = 0; i < 300; ++i)
    many += cellAt(1 + 10 * i, 5000.0 * i) + std::to_string(9 + 10 * i) + " 3 " + std::to_string(5000 * i + 42) +
            " 400 0 1 " + std::to_string(8 + 10 * i) + "\n";
  test::writeBelow(folder, "in/many.swc", many);
  test::writeBelow(folder, "in/empty.swc", "");
  const Outcome outcome = runFiliform({"check", folder.file("in"), "--report", folder.file("r.html")});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.out.find("and 200 more doubts"), std::string::npos) << outcome.out;
  const std::string page = test::readBytes(folder.file("r.html"));
  EXPECT_LT(page.find("<h2>empty.swc"), page.find("<h2>many.swc"));
}

// A neurite of `steps` steps in a zigzag, in any unit.
std::string neuriteText(double step, int steps) {
  std::string text = "1 1 0 0 0 1 -1\n";
  for (int i = 1; i <= steps; ++i)
    text += std::to_string(i + 1) + " 3 " + std::to_string(0.8 * step * i) + " " +
            std::to_string(i % 2 == 0 ? 0 : 0.6 * step) + " 0 1 " + std::to_string(i) + "\n";
  return text;
}

TEST(Check, AStatedUnitOfAWholeBrainAxonDrawsNoLine) {
  const test::TempFolder folder;
  const std::string file = folder.file("mm.swc");
  test::writeBytes(file, neuriteText(0.044, 900));
  const Outcome stated = runFiliform({"check", file, "--unit", "mm"});
  EXPECT_EQ(stated.exit_code, 0);
  EXPECT_EQ(stated.err, "");
}

TEST(Check, VoxelsOf8NanometresDrawOneLine) {
  const test::TempFolder folder;
  const std::string file = folder.file("em.swc");
  test::writeBytes(file, neuriteText(44, 900));
  const Outcome check = runFiliform({"check", file});
  EXPECT_EQ(check.exit_code, 0);
  EXPECT_TRUE(check.oneLineOnStderr()) << check.err;
  EXPECT_NE(check.err.find("filiform: note: the unit looks wrong"), std::string::npos) << check.err;
  EXPECT_NE(check.err.find("--unit 8nm"), std::string::npos) << check.err;
  EXPECT_EQ(check.out.substr(0, check.out.find(';')), "1 input: 1 accepted, 0 with warnings, 0 refused");
  EXPECT_EQ(runFiliform({"check", file, "--strict"}).exit_code, 0);
  const Outcome json = runFiliform({"check", file, "--json"});
  EXPECT_EQ("filiform: note: " + nlohmann::json::parse(json.out).at("unit_doubt").get<std::string>() + "\n", check.err);

  const Outcome ingest = runFiliform({"ingest", file, "-o", folder.file("em.fil")});
  EXPECT_EQ(ingest.exit_code, 0);
  EXPECT_EQ(ingest.err, check.err);

  for (const char* unit : {"8nm", "0.008"}) {
    const Outcome stated = runFiliform({"check", file, "--unit", unit});
    EXPECT_EQ(stated.exit_code, 0);
    EXPECT_EQ(stated.err, "") << unit;
  }
  EXPECT_EQ(runFiliform({"check", file, "--unit", "furlong"}).exit_code, 2);
  EXPECT_EQ(runFiliform({"check", file, "--unit", "-8nm"}).exit_code, 2);
}

TEST(Check, FilesOfTheCorpusInMicrometresDrawNoLine) {
  FILIFORM_NEEDS_CORPUS();
  // In voxels of 8 nm. All else is in um or looks like it: arteries in mm, axons in pixels.
  const fs::path voxels = *test::corpusFolder() / "morphologies" / "hemibrain-em";
  std::size_t files = 0, doubted = 0;
  for (const auto& entry : fs::recursive_directory_iterator(*test::corpusFolder() / "morphologies")) {
    if (entry.path().extension() != ".swc") continue;
    ++files;
    Input input({entry.path().string()});
    for (Cell cell; input.next(cell);) {
    }
    const std::string doubt = input.unitDoubt();
    const bool in_voxels = entry.path().string().starts_with(voxels.string());
    EXPECT_EQ(!doubt.empty(), in_voxels) << entry.path() << ": " << doubt;
    if (!in_voxels) continue;
    ++doubted;
    EXPECT_NE(doubt.find("--unit 8nm"), std::string::npos) << doubt;
    EXPECT_EQ(runFiliform({"check", entry.path().string()}).err, "filiform: note: " + doubt + "\n");
    EXPECT_EQ(runFiliform({"check", entry.path().string(), "--unit", "8nm"}).err, "");
  }
  EXPECT_EQ(files, 930u);
  EXPECT_EQ(doubted, 5u);
}

}  // namespace
}  // namespace filiform
