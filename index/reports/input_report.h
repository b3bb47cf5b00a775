// The report on one input: how much was kept, and one record for each dropped line, cut link or remark.
//
// Rules: a sample is kept if and only if its id and x, y, z are valid. Nothing is moved, invented or scaled. Each
// dropped line and each cut link is one record. So candidate lines = samples + dropped lines + merged points, and links
// given = segments + cut links; every run checks this. The only invention are links from a soma to its neurites in
// formats without any (SOMA_LINK); they count as given. Thread rule: values, thread-compatible.
#pragma once

#include "index/geometry/grid.h"
#include "index/reports/input_records.h"

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace filiform {

// E_: the file, entry or archive is refused. W_: something was dropped, cut or remarked; the rest is kept. Others are
// notes: the format means it so. A note neither warns nor counts under --strict.
enum class InputCode : std::uint8_t {
  E_DECIMAL_COMMA,
  E_ENCODING,
  E_FORMAT,
  E_MOSTLY_BAD,
  E_NOT_TEXT,
  E_NO_SAMPLES,
  E_UNREADABLE,
  E_ZIP_CRC,
  E_ZIP_FORMAT,
  E_ZIP_METHOD,
  E_ZIP_NO_SWC,
  E_ZIP_OVERLAP,
  E_ZIP_SIZE,
  E_ZIP_TRUNCATED,
  LOOSE_TREE,
  NULL_MORPHOLOGY,
  OTHER_VERSION,
  REPEATED_POINT,
  SOMA_CONTOUR,
  SOMA_LINK,
  W_ATTRIBUTE,
  W_BAD_ID,
  W_BAD_LINE,
  W_BAD_PARENT,
  W_BAD_RADIUS,
  W_BAD_TYPE,
  W_BOM,
  W_CR,
  W_CYCLE,
  W_DUP_ID,
  W_ELEMENT,
  W_EXTRA_COLUMNS,
  W_FLOAT_ID,
  W_HEADER_SCALE,
  W_ID_RESTART,
  W_LONG_LINE,
  W_MISSING_PARENT,
  W_NONFINITE,
  W_NUL,
  W_ORDER,
  W_RANGE,
  W_ROOT_CODE,
  W_SELF_PARENT,
  W_SEPARATOR,
  W_SHORT_LINE,
  W_SOMA_OFFSET,
  W_UNITS,
  W_ZERO_RADIUS,
  W_ZIP_DUP_NAME,
  W_ZIP_LINK,
  W_ZIP_NAME,
  W_ZIP_NAME_ENCODING,
  W_ZIP_NESTED,
  W_ZIP_UNSAFE_NAME,
};
inline constexpr std::size_t kInputCodes = static_cast<std::size_t>(InputCode::W_ZIP_UNSAFE_NAME) + 1;

// The code as text: "W_ORDER". Enumerators are in printing order: E_ first, then notes, each alphabetical.
std::string_view name(InputCode code);
// The meaning and what was done, for the user: "parent defined after its child; kept".
std::string_view explanation(InputCode code);
inline bool isRefusal(InputCode code) { return code < InputCode::LOOSE_TREE; }
inline bool isNote(InputCode code) { return !isRefusal(code) && code < InputCode::W_ATTRIBUTE; }

// E_MOSTLY_BAD: more than half of the candidates cannot be read, or less than a tenth of them is kept, as of a table
// whose first column is a cell's id.
inline bool isMostlyBad(std::uint64_t candidates, std::uint64_t unreadable, std::uint64_t kept) {
  return unreadable > candidates / 2 || kept < (candidates + 9) / 10;
}

// kPassed: a file of a folder or archive that is no input, since it holds no cell or its format is not read.
enum class Severity : std::uint8_t { kPassed, kAccept, kWarn, kRefuse };
// "passed", "accept", "warn", "refuse".
std::string_view name(Severity severity);

// How often each code occurred. Sorted by code, since there are few.
class CodeCounts {
 public:
  void add(InputCode code, std::uint64_t count = 1);
  void add(const CodeCounts& other);
  std::uint64_t operator[](InputCode code) const;
  bool empty() const { return counts_.empty(); }
  // In printing order; only counts above 0.
  const std::vector<std::pair<InputCode, std::uint64_t>>& all() const { return counts_; }
  bool anyRefusal() const { return !counts_.empty() && isRefusal(counts_.front().first); }
  bool anyWarning() const { return !counts_.empty() && counts_.back().first >= InputCode::W_ATTRIBUTE; }

 private:
  std::vector<std::pair<InputCode, std::uint64_t>> counts_;
};

// What the header of an SWC file states.
struct SwcHeader {
  std::optional<Vector3d> scale;   // of a `# SCALE` line; never applied
  std::optional<Vector3d> offset;  // last `# OFFSET` line, in the file's unit; applied only with apply_offset
  std::string units;               // word for a unit other than um ("pixels"), escaped
};

struct InputReport {
  // For each code, only the first kTokensKept records keep their token, and later remarks get no record. Counts stay
  // exact.
  static constexpr std::uint64_t kTokensKept = 100;

  Severity severity = Severity::kAccept;
  std::uint64_t cells = 0;     // that Input gives; more than 1 if a file holds several
  std::uint64_t samples = 0;   // kept; 0 when refused
  std::uint64_t segments = 0;  // links kept; 0 when refused
  std::uint64_t isolated = 0;  // kept samples without any link
  std::uint64_t roots = 0;     // kept samples without a parent
  std::uint64_t candidate_lines = 0;
  std::uint64_t dropped_lines = 0;
  std::uint64_t merged_points = 0;  // of sections and somata: another sample stands for the point
  std::uint64_t links_given = 0;    // kept samples whose parent field is not -1
  std::uint64_t links_cut = 0;
  std::uint64_t later_comments = 0;  // lines after the first sample, which a cell does not keep
  CodeCounts codes;
  InputRecords records;  // every dropped line and cut link, and the first remarks of each code
  std::string doubts;    // about the anatomy, for which check --profile strict refuses the input; else empty
  SwcHeader header;
};

// Why the input was refused: the meaning of its first refusal; for E_UNREADABLE, the system's reason. Empty if it was
// not refused.
std::string refusalReason(const InputReport& report);

// Thrown if something was lost without a record: a bug, so the run must stop. Names the file.
class ConservationError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

}  // namespace filiform
