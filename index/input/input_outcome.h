// What became of each input, and why. Every report on a run is made from these outcomes: the summary, the tables of
// `check`, `--report`, the provenance of a set, and the report that Python returns.
//
// Thread rule: pure functions.
#pragma once

#include "index/input/source_report.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace filiform {

// The fate of one input: a file or an archive entry. A lost entry counts as skipped unless its archive is refused. So
// an input is refused only if anyRefused() is true. A file that is passed over is no input.
enum class InputFate : std::uint8_t { kAccepted, kWarned, kSkipped, kRefused, kPassed };
// "accepted", "warned", "skipped", "refused", "passed".
std::string_view name(InputFate fate);

struct InputOutcome {
  InputFate fate = InputFate::kAccepted;
  // Of a skipped or refused input: the code at fault, and its meaning or the system's reason. An input that --strict
  // refuses for its warnings has no code; the reason lists them. A file that is passed over has a reason only.
  std::string code, reason;

  bool isLost() const { return fate == InputFate::kSkipped || fate == InputFate::kRefused; }
};

// Of a file, or of an archive that is refused without a refused entry. nullopt: an archive whose entries count instead.
std::optional<InputOutcome> outcomeOfInput(const SourceReport& row);
// Of an entry of an archive.
InputOutcome outcomeOfInput(const SourceReport& row, const EntryReport& entry);
// Calls `use` for each input and each file that was passed over, in the order of the reports; an entry is named
// `archive/entry`. Names are raw bytes.
using UseInput = std::function<void(const std::string& input, const InputReport& report, const InputOutcome& outcome)>;
void forEachInput(const std::vector<SourceReport>& reports, const UseInput& use);

// The codes with their counts, `W_CYCLE:1,W_ORDER:3`; `-` without codes.
std::string codesText(const CodeCounts& codes);

}  // namespace filiform
