// Figures by `filiform render`: chosen cells, grounds, marks, sizes on paper, SVG and PDF.
#include "tests/support/golden.h"
#include "tests/support/process.h"
#include "tests/support/temp_folder.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace filiform {
namespace {

using test::Outcome;
using test::runFiliform;

class FigureCommand : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TempFolder>();
    ASSERT_EQ(
        runFiliform({"synth", folder_->file("c.zip"), "--kind", "column", "--cells", "8", "--seed", "3"}).exit_code, 0);
    ASSERT_EQ(runFiliform({"ingest", folder_->file("c.zip"), "-o", folder_->file("c.fil")}).exit_code, 0);
  }
  static void TearDownTestSuite() { folder_.reset(); }
  void SetUp() override {
    const Outcome tried = render("try.png", {"--size", "16x16"});
    if (tried.exit_code == 3 && tried.err.find("OpenGL") != std::string::npos) GTEST_SKIP() << tried.err;
    ASSERT_EQ(tried.exit_code, 0) << tried.err;
  }
  static std::string path(const std::string& name) { return folder_->file(name); }
  static Outcome render(const std::string& out, std::vector<std::string> words) {
    words.insert(words.begin(), {"render", path("c.fil"), "-o", path(out)});
    // The OpenGL driver leaks (see tests/CMakeLists.txt).
    return test::runFiliformInShell("ASAN_OPTIONS=detect_leaks=0:strict_string_checks=1 exec \"$@\"", words);
  }
  static void expectRendered(const std::string& out, const std::vector<std::string>& words) {
    const Outcome outcome = render(out, words);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
  }
  static void expectRefused(const std::vector<std::string>& words, const std::vector<std::string>& parts) {
    const Outcome outcome = render("refused.png", words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
    for (const std::string& part : parts) EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(path("refused.png")));
  }
  // Of the pixels that are not white in one of the pictures, the part that has one within a pixel in the other.
  static double overlap(const Picture& a, const Picture& b) {
    const auto isInked = [](const Picture& p, int x, int y) {
      if (x < 0 || y < 0 || x >= p.width || y >= p.height) return false;
      const Rgba c = test::colourAt(p, x, y);
      return c.r + c.g + c.b < 3 * 235;
    };
    std::size_t met = 0, all = 0;
    for (const auto& [p, other] : {std::pair(&a, &b), std::pair(&b, &a)})
      for (int y = 0; y < p->height; ++y)
        for (int x = 0; x < p->width; ++x) {
          if (!isInked(*p, x, y)) continue;
          ++all;
          bool is_met = false;
          for (int dy = -1; dy <= 1; ++dy)
            for (int dx = -1; dx <= 1; ++dx) is_met |= isInked(*other, x + dx, y + dy);
          met += is_met;
        }
    EXPECT_GT(all, 2000U);
    return static_cast<double>(met) / static_cast<double>(all);
  }
  static Picture asPng(const std::string& document) {
    const bool is_svg = document.ends_with(".svg");
    const std::string line = is_svg ? "rsvg-convert " + path(document) + " -o " + path("made.png")
                                    : "pdftoppm -png -r 96 -singlefile " + path(document) + " " + path("made");
    EXPECT_EQ(std::system(line.c_str()), 0) << line;
    return test::readPng(path("made.png"));
  }

  static std::unique_ptr<test::TempFolder> folder_;
};
std::unique_ptr<test::TempFolder> FigureCommand::folder_;

const std::vector<std::string> kTwo{"--only",  "cell_00001",   "--only", "cell_00004", "--size",
                                    "900x600", "--background", "white",  "--samples",  "4"};

TEST_F(FigureCommand, VectorsCoverWhatThePictureCovers) {
  if (std::system("rsvg-convert --version >/dev/null 2>&1 && pdftoppm -v >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "needs librsvg2-bin and poppler-utils: run tools/setup";
  expectRendered("two.png", kTwo);
  const Picture pixels = test::readPng(path("two.png"));
  for (const char* const document : {"two.svg", "two.pdf"}) {
    SCOPED_TRACE(document);
    expectRendered(document, kTwo);
    const Picture lines = asPng(document);
    ASSERT_EQ(lines.width, pixels.width);
    ASSERT_EQ(lines.height, pixels.height);
    EXPECT_GE(overlap(pixels, lines), 0.98);
  }
}

TEST_F(FigureCommand, OnlyDrawsTheNamedCellsInTheirColours) {
  std::ofstream(path("names.txt")) << "cell_00004\r\nno_such_cell\n\ncell_00001\n";
  const Outcome listed = render("listed.png", {"--only", "@" + path("names.txt"), "--size", "900x600", "--background",
                                               "white", "--samples", "4", "--json"});
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_NE(listed.err.find("does not have 1 of 3 names, such as no_such_cell"), std::string::npos) << listed.err;
  EXPECT_TRUE(listed.oneLineOnStderr());
  expectRendered("named.png", kTwo);
  EXPECT_EQ(test::readPng(path("listed.png")).rgb, test::readPng(path("named.png")).rgb);
  expectRefused({"--only", "cell_0000x"}, {"--only cell_0000x", "cell_00000"});
  expectRefused({"--only", "soma_depth=1"}, {"soma_depth"});
  expectRefused({"--only", "measure:length>1e12"}, {"--only measure:length>1e12", "no cell meets"});
  std::ofstream(path("none.txt")) << std::string(60'000, 'x') << '\n';
  expectRefused({"--only", "@" + path("none.txt")}, {"the set has none of its 1 name"});
}

TEST_F(FigureCommand, MarksAreAddedToTheSamePicture) {
  expectRendered("plain.png", kTwo);
  std::vector<std::string> words = kTwo;
  words.insert(words.end(),
               {"--scale-bar", "--orientation", "--title", "Two cells", "--colour-by", "type", "--legend"});
  expectRendered("marked.png", words);
  const Picture marked = test::readPng(path("marked.png"));
  const auto inked = [&](int x0, int y0, int x1, int y1) {
    int n = 0;
    for (int y = y0; y < y1; ++y)
      for (int x = x0; x < x1; ++x) n += test::colourAt(marked, x, y).g < 120;
    return n;
  };
  EXPECT_GT(inked(600, 560, 900, 600), 60) << "the scale bar";
  EXPECT_GT(inked(0, 520, 90, 600), 20) << "the arrows";
  EXPECT_GT(inked(350, 0, 550, 40), 60) << "the title";
  EXPECT_GT(inked(0, 0, 150, 120), 60) << "the legend";
}

TEST_F(FigureCommand, AClearGroundShowsWhatLiesBehind) {
  std::vector<std::string> words = kTwo;
  words[7] = "none";
  expectRendered("clear.png", words);
  const std::string bytes = test::readBytes(path("clear.png"));
  EXPECT_EQ(bytes.at(25), 6) << "the PNG has an alpha channel";
  const Picture on_black = test::readPng(path("clear.png"));
  EXPECT_EQ(test::colourAt(on_black, 0, 0), (Rgba{0, 0, 0}));
  expectRendered("clear.svg", words);
  EXPECT_EQ(test::readBytes(path("clear.svg")).find("<rect"), std::string::npos);
}

TEST_F(FigureCommand, SizeOnPaperIsStated) {
  expectRendered("paper.png", {"--size-mm", "85x60", "--dpi", "254"});
  const std::string bytes = test::readBytes(path("paper.png"));
  EXPECT_EQ(bytes.substr(37, 4), "pHYs");
  EXPECT_EQ(bytes.substr(41, 9), std::string("\0\0\x27\x10\0\0\x27\x10\1", 9)) << "10 000 dots a metre";
  EXPECT_EQ(test::readPng(path("paper.png")).width, 850);
  expectRendered("paper.svg", {"--size-mm", "85x60", "--only", "cell_00001"});
  EXPECT_NE(test::readBytes(path("paper.svg")).find("width=\"85.0"), std::string::npos);
  expectRefused({"--size-mm", "2000x2000", "--dpi", "600"}, {"47244 x 47244 pixels", "8192"});
  for (const char* const wrong : {"85", "85x60x2"})
    expectRefused({"--size-mm", wrong}, {"--size-mm " + std::string(wrong), "WIDTHxHEIGHT in mm"});
  expectRefused({"--size-mm", "85x60", "--size", "10x10"}, {"--size"});
  expectRefused({"--background", "pink"}, {"white, dark or none"});
  expectRefused({"--legend"}, {"--legend", "by type"});
  expectRefused({"--scale-bar", "--stereo", "anaglyph"}, {"mono"});
}

TEST_F(FigureCommand, ATableColoursCellsAndWhatIsUnknownIsCounted) {
  std::vector<std::string> names;
  for (int cell = 0; cell < 8; ++cell) names.push_back("cell_0000" + std::to_string(cell));
  const std::string table = path("colours.tsv");
  std::string lines = "cell\tcolour\tnote\r\n";
  for (const std::string& name : names) lines += name + "\t#ff0000\tx\r\n";
  std::ofstream(table) << lines;
  const std::vector<std::string> flat{"--background", "dark", "--size", "200x150", "--colour-table", table};
  expectRendered("red.png", flat);
  const Picture red = test::readPng(path("red.png"));
  std::size_t lit = 0;
  for (std::size_t i = 0; i < red.rgb.size(); i += 3) {
    if (red.rgb[i] > 80) ++lit;
    EXPECT_LE(red.rgb[i + 1], std::max<int>(40, red.rgb[i] / 2)) << "all is red, or the ground";
  }
  EXPECT_GT(lit, 100u);
  std::ofstream(table) << "no_such_cell\t#00ff00\n"
                       << names[0] << "\t#00ff00\n"
                       << names[1] << "\tgreen\nnone\t#123456\n";
  const Outcome outcome = render("one.png", flat);
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_TRUE(outcome.oneLineOnStderr()) << outcome.err;
  for (const char* const part : {"does not have 2 of the names, such as no_such_cell", "1 line without a colour"})
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  std::ofstream(table) << "no_such_cell\t#00ff00\n";
  expectRefused({"--colour-table", table}, {"no line colours a cell", "no_such_cell"});
  expectRefused({"--colour-table", table, "--colour-by", "type"}, {"--colour-by"});
  // Two highlighted cells differ from either.
  const std::vector<std::string> small{"--size", "200x150"};
  const auto with = [&](std::vector<std::string> highlights) {
    std::vector<std::string> words = small;
    for (const std::string& name : highlights) words.insert(words.end(), {"--highlight", name});
    expectRendered("highlight.png", words);
    return test::readPng(path("highlight.png")).rgb;
  };
  const auto both = with({names[0], names[1]});
  EXPECT_EQ(both, with({names[1], names[0]}));
  EXPECT_NE(both, with({names[0]}));
  EXPECT_NE(both, with({names[1]}));
}

}  // namespace
}  // namespace filiform
