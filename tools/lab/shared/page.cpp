#include "tools/lab/shared/page.h"

#include "index/errors.h"
#include "index/text.h"
#include "tools/serve/routes/html.h"

#include <cerrno>
#include <fstream>
#include <iterator>
#include <sstream>

namespace filiform::tools {

namespace {

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --ink: #26262b; --grey: #787880; --paper: #fff; --grid: #e8e8ec; --link: #0072b2; --missed: #d55e00; }
@media screen and (prefers-color-scheme: dark) { :root { --ink: #e4e4e8; --grey: #9a9aa4; --paper: #16161a; --grid: #33333a; --link: #59a3cd; --missed: #e47e33; } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); margin: 2rem auto; max-width: 1100px; padding: 0 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.25rem; margin-top: 2.5rem; border-bottom: 1px solid var(--grid); }
table { border-collapse: collapse; margin: 1rem 0 1.5rem; font-size: 13px; display: block; overflow-x: auto; }
caption { text-align: left; font-weight: 600; padding: .3rem 0; }
th, td { padding: .2rem .6rem; border-bottom: 1px solid var(--grid); text-align: right; white-space: nowrap; }
th { border-bottom: 2px solid var(--grey); } td.t, th.t { text-align: left; }
td.long { white-space: normal; min-width: 14rem; }
figure { margin: 1.5rem 0; } img { max-width: 100%; border: 1px solid var(--grid); background: #fff; }
figcaption { color: var(--grey); font-size: 13px; } td.missed { color: var(--missed); font-weight: 600; }
nav a { margin-right: 1rem; } a { color: var(--link); }
@media print { :root { color-scheme: light; } body { max-width: none; margin: 0; font-size: 11px; } nav { display: none; }
  figure, tr { break-inside: avoid; } h2 { break-after: avoid; } table { display: table; font-size: 8px; } th, td { padding: .1rem .25rem; white-space: normal; } td.long { overflow-wrap: anywhere; min-width: 0; } }
)";

std::string bytesOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file) throw IoError(path, "cannot read", errno);
  return bytes;
}

void putPicture(std::ostream& out, const std::string& description, const char* kind, const std::string& bytes,
                const std::string& caption) {
  out << "<figure><img alt=\"" << htmlText(description) << "\" src=\"data:image/" << kind << ";base64,"
      << toBase64(bytes) << "\"><figcaption>" << htmlText(caption) << "</figcaption></figure>\n";
}

constexpr std::size_t kLongText = 48;  // letters: longer cells of a table are broken into lines

bool isText(const BenchValue& value) { return std::holds_alternative<std::string>(value); }

void putTable(std::ostream& out, const BenchTable& table) {
  // A column is aligned to the left if its first row holds text.
  const auto cell = [&](std::size_t column) {
    return !table.rows.empty() && isText(table.rows.front()[column]) ? " class=\"t\"" : "";
  };
  out << "<table><caption>" << htmlText(table.caption) << "</caption>\n<tr>";
  for (std::size_t i = 0; i < table.columns.size(); ++i)
    out << "<th" << cell(i) << '>' << htmlText(table.columns[i]) << "</th>";
  out << "</tr>\n";
  for (const auto& row : table.rows) {
    out << "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) {
      const std::string text = shown(row[i]);
      const bool words = text.size() > kLongText;
      out << "<td"
          << (text == "missed" ? " class=\"missed\""
              : words          ? " class=\"t long\""
                               : cell(i))
          << '>' << htmlText(text) << "</td>";
    }
    out << "</tr>\n";
  }
  out << "</table>\n";
}

}  // namespace

std::string htmlPage(const std::string& title, const std::vector<PageSection>& sections, const std::string& folder) {
  std::ostringstream out;
  out << "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>" << htmlText(title)
      << "</title><meta name=\"viewport\" content=\"width=device-width\"><style>" << kStyle
      << "</style></head><body>\n<h1>" << htmlText(title) << "</h1>\n<nav>";
  for (std::size_t i = 0; i < sections.size(); ++i)
    out << "<a href=\"#s" << i << "\">" << htmlText(sections[i].heading) << "</a> ";
  out << "</nav>\n";
  for (std::size_t i = 0; i < sections.size(); ++i) {
    const PageSection& section = sections[i];
    out << "<h2 id=\"s" << i << "\">" << htmlText(section.heading) << "</h2>\n";
    for (const std::string& paragraph : section.paragraphs) out << "<p>" << htmlText(paragraph) << "</p>\n";
    for (const PageFigure& figure : section.figures)
      putPicture(out, figure.description, "svg+xml", figure.svg, figure.caption);
    for (const BenchTable& table : section.tables) putTable(out, table);
    for (const PagePicture& picture : section.pictures)
      putPicture(out, picture.caption, "png", bytesOf(folder + "/" + picture.file), picture.caption);
  }
  out << "</body></html>\n";
  return out.str();
}

std::string markdownPage(const std::string& title, const std::vector<PageSection>& sections) {
  std::ostringstream out;
  out << "# " << title << '\n';
  for (const PageSection& section : sections) {
    out << "\n## " << section.heading << '\n';
    for (const std::string& paragraph : section.paragraphs) out << '\n' << paragraph << '\n';
    for (const BenchTable& table : section.tables) out << '\n' << markdownTable(table);
    for (const PagePicture& picture : section.pictures)
      out << "\n![" << picture.caption << "](" << picture.file << ")\n";
  }
  return out.str();
}

}  // namespace filiform::tools
