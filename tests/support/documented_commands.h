// The command lines of filiform in documents and help texts, changed so that a test can run them. Pure functions.
//
// These rules tell which text is an example:
//  - In Markdown: a line of a fenced block, or a code span. In a help text: a line after two blanks. `filiform` must be
//    the first word, after NAME=VALUE, `xvfb-run -a` and `umockdev-run ... --`. `; ` separates two examples.
//  - A code span with only the command's name is no example, but a mention.
//  - A line with `[`, `|`, `...` or a word in capitals without stand-in (standIns()) is no example, but a synopsis.
// The words "no test runs this" in a line keep its commands from being run.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace filiform::test {

enum class DocumentedKind { example, mention, synopsis, not_run };

struct DocumentedCommand {
  std::string document;
  std::size_t line = 0;  // from 1
  std::string text;      // as in the document, without remarks
  DocumentedKind kind = DocumentedKind::example;
};

// `text` is Markdown.
std::vector<DocumentedCommand> commandsOfMarkdown(const std::string& document, const std::string& text);
// `text` is what `filiform COMMAND --help` prints.
std::vector<DocumentedCommand> commandsOfHelp(const std::string& document, const std::string& text);

// Placeholders and their values in the scratch folder: CORPUS is `corpus`, NAME is `cell_00042`.
const std::vector<std::pair<std::string, std::string>>& standIns();

struct RunnableCommand {
  std::string text;
  bool shortened = false;  // changed beyond stand-ins: fewer cells, less time, smaller pictures, --quick
};
// Returns a command line for bash that does the same in at most a few seconds. `view` gets its own display.
RunnableCommand runnable(const std::string& text);

// The option names in code spans that begin with an option: `--budget`, `--zoom 100`.
std::vector<DocumentedCommand> optionsOfMarkdown(const std::string& document, const std::string& text);

}  // namespace filiform::test
