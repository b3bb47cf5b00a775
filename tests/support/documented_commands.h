// The command lines of filiform that documents and help texts show, made fit to be run by a test. Pure functions.
//
// What an example is:
//  - in Markdown a line of a fenced block, or a code span, and in a help text a line after two blanks, in which
//    `filiform` is the first word, after NAME=VALUE, `xvfb-run -a` and `umockdev-run ... --`; `; ` separates two of
//    them;
//  - but not a code span of the command's name alone, which is a mention, and not a synopsis, which has `[`, `|`, `...`
//    or a word in capitals that has no stand-in (standIns()).
// A line with the words "no test runs this" keeps its commands from being run.
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
  std::string text;      // as it stands there, without remarks
  DocumentedKind kind = DocumentedKind::example;
};

// `text` is Markdown.
std::vector<DocumentedCommand> commandsOfMarkdown(const std::string& document, const std::string& text);
// `text` is what `filiform COMMAND --help` prints.
std::vector<DocumentedCommand> commandsOfHelp(const std::string& document, const std::string& text);

// Placeholders, and what the scratch folder has for them: CORPUS is `corpus`, NAME `cell_00042`.
const std::vector<std::pair<std::string, std::string>>& standIns();

struct RunnableCommand {
  std::string text;
  bool shortened = false;  // beside its stand-ins: fewer cells, less time, smaller pictures, --quick
};
// A command line for bash that does the same in at most a few seconds. `view` gets a display of its own.
RunnableCommand runnable(const std::string& text);

// Names of options in code spans that begin with one: `--budget`, `--zoom 100`.
std::vector<DocumentedCommand> optionsOfMarkdown(const std::string& document, const std::string& text);

}  // namespace filiform::test
