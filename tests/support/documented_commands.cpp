#include "tests/support/documented_commands.h"

#include <algorithm>
#include <array>
#include <regex>
#include <sstream>

namespace filiform::test {

namespace {

std::string trimmedLine(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

std::string withoutRemark(const std::string& text) {
  static const std::regex kRemark("(\\s+#|\\s{2,}\\().*$");
  return trimmedLine(std::regex_replace(text, kRemark, ""));
}

// The words before the program's name on a command line.
const char* const kBefore = "^((?:[A-Z_]+=\\S+\\s+)*(?:xvfb-run -a\\s+|umockdev-run .* -- )?)filiform(\\s|$)";

bool isCommand(const std::string& text) {
  static const std::regex kCommand(kBefore);
  return std::regex_search(text, kCommand);
}

bool isSynopsis(std::string text) {
  static const std::regex kAssignments("^(?:[A-Z_]+=)"), kBytes("\\b[0-9.]+ ?[KMGT](iB|B)?\\b"), kCapitals("[A-Z]"),
      kSyntax("\\[|\\||\\.\\.\\.");
  for (const auto& [placeholder, stand_in] : standIns())
    text = std::regex_replace(text, std::regex("\\b" + placeholder + "\\b"), stand_in);
  text = std::regex_replace(std::regex_replace(text, kAssignments, ""), kBytes, "");
  return std::regex_search(text, kCapitals) || std::regex_search(text, kSyntax);
}

std::vector<std::string> partsOf(const std::string& text) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find("; ", begin), text.size());
    parts.push_back(trimmedLine(text.substr(begin, end - begin)));
    begin = end + 2;
  }
  return parts;
}

struct MarkdownSpan {
  std::size_t line;
  std::string text;
  bool block;  // a line of a fenced block
  bool not_run;
};

std::vector<MarkdownSpan> spansOf(const std::string& text) {
  static const std::regex kSpan("`([^`]+)`");
  std::vector<MarkdownSpan> spans;
  std::istringstream in(text);
  bool fenced = false;
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    const bool not_run = line.find("no test runs this") != std::string::npos;
    if (line.starts_with("```")) {
      fenced = !fenced;
    } else if (fenced || line.starts_with("    ")) {
      spans.push_back({number, trimmedLine(line), true, not_run});
    } else {
      for (std::sregex_iterator i(line.begin(), line.end(), kSpan), end; i != end; ++i)
        spans.push_back({number, std::regex_replace((*i)[1].str(), std::regex("\\\\\\|"), "|"), false, not_run});
    }
  }
  return spans;
}

// Replaces the value of an option, or appends option and value. Returns whether the text changed.
bool setOption(std::string& text, const std::string& option, const std::string& value) {
  const std::string before = text;
  const std::regex kGiven(option + "[ =]\\S+");
  std::string with = option;
  (with += ' ') += value;
  if (std::regex_search(text, kGiven)) {
    text = std::regex_replace(text, kGiven, with);
  } else {
    (text += ' ') += with;
  }
  return text != before;
}

// Lowers the number of an option, if the option is given.
bool lowerOption(std::string& text, const std::string& option, double most) {
  std::smatch found;
  if (!std::regex_search(text, found, std::regex(option + " ([0-9.]+)")) || std::stod(found[1].str()) <= most)
    return false;
  std::ostringstream value;
  value << most;
  return setOption(text, option, value.str());
}

bool dropOption(std::string& text, const std::string& pattern) {
  const std::string before = text;
  text = std::regex_replace(text, std::regex(" " + pattern), "");
  return text != before;
}

}  // namespace

const std::vector<std::pair<std::string, std::string>>& standIns() {
  static const std::vector<std::pair<std::string, std::string>> kStandIns{{"A\\.json", "before/bench.json"},
                                                                          {"B\\.json", "after/bench.json"},
                                                                          {"CELL\\.swc", "cell.swc"},
                                                                          {"CORPUS", "corpus"},
                                                                          {"DIR", "corpus/morphologies"},
                                                                          {"OUT", "out"},
                                                                          {"SET", "column.fil"},
                                                                          {"FILE", "soma.txt"},
                                                                          {"NAME", "cell_00042"},
                                                                          {"CELL", "cell_00042"},
                                                                          {"Z", "300"},
                                                                          {"M", "climb"},
                                                                          {"B", "1MiB"}};
  return kStandIns;
}

std::vector<DocumentedCommand> commandsOfMarkdown(const std::string& document, const std::string& text) {
  static const std::regex kName("^filiform( +[a-z]+)?$");
  std::vector<DocumentedCommand> commands;
  for (const MarkdownSpan& span : spansOf(text)) {
    for (const std::string& part : partsOf(withoutRemark(span.text))) {
      if (!isCommand(part)) continue;
      const DocumentedKind kind = !span.block && std::regex_match(part, kName) ? DocumentedKind::mention
                                  : span.not_run                               ? DocumentedKind::not_run
                                  : isSynopsis(part)                           ? DocumentedKind::synopsis
                                                                               : DocumentedKind::example;
      commands.push_back({document, span.line, part, kind});
    }
  }
  return commands;
}

std::vector<DocumentedCommand> commandsOfHelp(const std::string& document, const std::string& text) {
  std::vector<DocumentedCommand> commands;
  std::istringstream in(text);
  std::size_t number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    if (!line.starts_with("  ")) continue;
    for (const std::string& part : partsOf(withoutRemark(line)))
      if (isCommand(part))
        commands.push_back(
            {document, number, part, isSynopsis(part) ? DocumentedKind::synopsis : DocumentedKind::example});
  }
  return commands;
}

std::vector<DocumentedCommand> optionsOfMarkdown(const std::string& document, const std::string& text) {
  static const std::regex kOption("^(--[a-z][a-z-]*)");
  std::vector<DocumentedCommand> options;
  std::smatch found;
  for (const MarkdownSpan& span : spansOf(text))
    if (!span.block && std::regex_search(span.text, found, kOption))
      options.push_back({document, span.line, found[1].str(), DocumentedKind::mention});
  return options;
}

RunnableCommand runnable(const std::string& text) {
  RunnableCommand command{text, false};
  for (const auto& [placeholder, stand_in] : standIns())
    command.text = std::regex_replace(command.text, std::regex("\\b" + placeholder + "\\b"), stand_in);
  std::string& line = command.text;
  std::smatch found;
  static const std::regex kCommand(std::string(kBefore) + "\\s*([a-z]*)");
  if (!std::regex_search(line, found, kCommand)) return command;
  const std::string name = found[3].str();
  bool& shortened = command.shortened;
  const bool help = line.find(" --help") != std::string::npos;
  if (help || name.empty()) return command;
  if (name == "synth") shortened |= lowerOption(line, "--cells", 3);
  if (name == "navigate") shortened |= setOption(line, "--seconds", "0.5");
  if (name == "render" && line.find(" --size-mm") == std::string::npos)
    shortened |= setOption(line, "--size", "160x100");
  if (name == "evaluate") {
    setOption(line, "--routes", "2");
    if (line.find(" --methods") == std::string::npos) line += " --methods climb";
    line += " --quick";
    shortened = true;
  }
  if (name == "bench" && line.find(" --list") == std::string::npos) {
    static const std::regex kWithoutName("filiform\\s+bench(\\s+--|$)");
    if (std::regex_search(line, kWithoutName))
      line = std::regex_replace(line, kWithoutName, "filiform bench extremes$1");
    dropOption(line, "--(size|segments) \\S+");
    dropOption(line, "--long\\b");
    line += " --quick";
    shortened = true;
  }
  // These never end by themselves; timeout would signal its group too, and a second signal ends at once.
  const std::string for_a_while = "timeout --foreground --preserve-status -s TERM 2 ";
  if (name == "serve") {
    dropOption(line, "--listen \\S+");
    line = for_a_while + line + " --listen 127.0.0.1:0";
    shortened = true;
  }
  if (static const std::regex kSimulated("--simulate-haply( [0-9]+)?( &)?"); std::regex_search(line, kSimulated)) {
    line = for_a_while + std::regex_replace(line, kSimulated, "--simulate-haply 0");
    shortened = true;
  }
  const bool in_browser = line.find(" --web") != std::string::npos;
  if (name == "view" && in_browser) {
    line.insert(0, for_a_while);
    shortened = true;
  }
  if (name == "view" && !in_browser && line.find(" --keys") == std::string::npos) {
    shortened |= setOption(line, "--seconds", line.find(" --record") == std::string::npos ? "0.3" : "2");
    if (line.find("xvfb-run") == std::string::npos) line.insert(0, "xvfb-run -a ");
  }
  return command;
}

}  // namespace filiform::test
