#include "index/reports/input_report.h"

#include <algorithm>
#include <array>
#include <string>

namespace filiform {
namespace {

struct CodeText {
  std::string_view name, explanation;
};

constexpr std::array<CodeText, kInputCodes> kTexts = {{
    {"E_DECIMAL_COMMA", "decimal commas or thousands separators; export it with decimal points"},
    {"E_ENCODING", "UTF-16 or UTF-32 text; save it as UTF-8"},
    {"E_FORMAT", "not the format of its file ending, or truncated"},
    {"E_MOSTLY_BAD", "more than half of its lines cannot be read as samples, or nearly all were dropped"},
    {"E_NOT_TEXT", "packed or binary data, not text; give it its own ending (.gz, .tar, .tar.gz, .zip), or unpack it"},
    {"E_NO_SAMPLES", "holds no sample"},
    {"E_UNREADABLE", "cannot be read"},
    {"E_ZIP_CRC", "damaged data (checksum or compressed stream); fetch it again"},
    {"E_ZIP_FORMAT", "not an archive of its ending, or one that contradicts itself"},
    {"E_ZIP_METHOD", "encrypted, or packed by a method that is not supported; pack it again"},
    {"E_ZIP_NO_SWC", "holds no neuron that may be read"},
    {"E_ZIP_OVERLAP", "entries overlap each other, as in a zip bomb"},
    {"E_ZIP_SIZE", "size differs from the declared one, or exceeds 4 GiB"},
    {"E_ZIP_TRUNCATED", "archive is cut short; fetch it again"},
    {"LOOSE_TREE", "trees without a soma in a file of several cells; kept as the cell NAME/loose"},
    {"NULL_MORPHOLOGY", "node without a morphology, as point neurons have none; not placed"},
    {"OTHER_VERSION", "the same neuron is there in another version; this one left out; --version chooses"},
    {"REPEATED_POINT", "first point of a section, equal to the point where it begins; one kept"},
    {"SOMA_CONTOUR", "outline of a soma; kept as a sphere at its mean, with the mean distance as radius"},
    {"SOMA_LINK", "link from the soma to a neurite, which the format does not state; --no-soma-links leaves it out"},
    {"W_ATTRIBUTE", "attribute that a set does not keep, of its name, type or length; left out"},
    {"W_BAD_ID", "id negative, fractional or too large; line dropped"},
    {"W_BAD_LINE", "id or coordinate is not a number; line dropped"},
    {"W_BAD_PARENT", "parent is not an integer; sample kept as a root"},
    {"W_BAD_RADIUS", "radius is negative, not finite or text; kept as unknown"},
    {"W_BAD_TYPE", "type is not in 0..65535; kept as 0"},
    {"W_BOM", "byte order mark; skipped"},
    {"W_CR", "lone carriage returns end lines; accepted"},
    {"W_CYCLE", "parents form a cycle; one link cut"},
    {"W_DUP_ID", "id seen before; later line dropped"},
    {"W_ELEMENT", "neither a node nor a link of a graph, such as a face; left out"},
    {"W_EXTRA_COLUMNS", "more columns than the format has; the first ones used"},
    {"W_FLOAT_ID", "id written with a decimal point; accepted"},
    {"W_HEADER_SCALE",
     "header states a SCALE or OFFSET, not applied; --apply-offset adds the OFFSET; the data already include a SCALE"},
    {"W_ID_RESTART", "ids restart: several cells in one file; all kept"},
    {"W_LONG_LINE", "data line of more than 64 KiB; dropped"},
    {"W_MISSING_PARENT", "no such parent; sample kept as a root (in graphs: no such node; link cut)"},
    {"W_NONFINITE", "coordinate is not finite; line dropped"},
    {"W_NUL", "NUL bytes; a data line with them is dropped"},
    {"W_ORDER", "parent defined after its child; kept"},
    {"W_RANGE", "coordinate beyond 1e9, or beyond 2^30 um once converted; line dropped"},
    {"W_ROOT_CODE", "parent of a root is not -1; kept as a root"},
    {"W_SELF_PARENT", "sample is its own parent; link cut"},
    {"W_SEPARATOR", "commas or semicolons between columns; accepted"},
    {"W_SHORT_LINE", "fewer columns than the format has; line dropped"},
    {"W_SOMA_OFFSET", "soma more than 1 um from the origin of its morphology; placed by its soma"},
    {"W_UNITS", "header names a unit other than um, not applied; --unit states the unit"},
    {"W_ZERO_RADIUS", "radius 0; kept"},
    {"W_ZIP_DUP_NAME", "entries of equal name; all kept"},
    {"W_ZIP_LINK", "symbolic link; skipped"},
    {"W_ZIP_NAME", "absolute name, drive, backslash or control character; read under a plain name"},
    {"W_ZIP_NAME_ENCODING", "name is not UTF-8; bytes kept"},
    {"W_ZIP_NESTED", "archive inside the archive; not opened"},
    {"W_ZIP_UNSAFE_NAME", "name leads out of the archive (..); skipped"},
}};

static_assert(std::all_of(kTexts.begin(), kTexts.end(), [](const CodeText& t) { return !t.explanation.empty(); }));
static_assert(std::is_sorted(kTexts.begin(), kTexts.end(),
                             [](const CodeText& a, const CodeText& b) { return a.name < b.name; }));

}  // namespace

std::string_view name(InputCode code) { return kTexts[static_cast<std::size_t>(code)].name; }

std::string_view explanation(InputCode code) { return kTexts[static_cast<std::size_t>(code)].explanation; }

std::string_view name(Severity severity) {
  static constexpr std::string_view kNames[] = {"passed", "accept", "warn", "refuse"};
  return kNames[static_cast<std::size_t>(severity)];
}

std::string_view name(Effect effect) {
  static constexpr std::string_view kNames[] = {"kept", "dropped", "cut", "left_out"};
  return kNames[static_cast<std::size_t>(effect)];
}

void CodeCounts::add(InputCode code, std::uint64_t count) {
  if (count == 0) return;
  const auto at = std::lower_bound(counts_.begin(), counts_.end(), code,
                                   [](const auto& entry, InputCode c) { return entry.first < c; });
  if (at != counts_.end() && at->first == code) {
    at->second += count;
  } else {
    counts_.insert(at, {code, count});
  }
}

void CodeCounts::add(const CodeCounts& other) {
  for (const auto& [code, count] : other.counts_) add(code, count);
}

std::uint64_t CodeCounts::operator[](InputCode code) const {
  const auto at = std::find_if(counts_.begin(), counts_.end(), [&](const auto& entry) { return entry.first == code; });
  return at == counts_.end() ? 0 : at->second;
}

std::string refusalReason(const InputReport& report) {
  if (!report.codes.anyRefusal()) return "";
  const InputCode code = report.codes.all().front().first;
  for (const InputRecord& record : report.records) {
    if (record.code != code || record.token.empty()) continue;
    if (code == InputCode::E_UNREADABLE) return record.token;
    if (code == InputCode::E_FORMAT)
      return (record.line > 0 ? "line " + std::to_string(record.line) + ": " : std::string()) + record.token;
  }
  return std::string(explanation(code));
}

}  // namespace filiform
