#include "tools/program/cli.h"

#include "device/haptic_device.h"
#include "index/errors.h"
#include "index/output.h"
#include "index/text.h"
#include "solver/force/force_hold.h"
#include "tools/program/config_file.h"
#include "tools/program/environment.h"
#include "tools/program/interruption.h"
#include "tools/program/usage_json.h"
#include "tools/words/near_names.h"
#include "tools/words/numbers.h"
#include "viewer/gl/graphics_context.h"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <exception>
#include <fcntl.h>
#include <iostream>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

std::string program_name = "filiform";

int fail(int code, const std::string& what) {
  // Callers escape and shorten what was given already. Doing so again covers a place that was forgotten, and the errors
  // of devices and libraries.
  constexpr std::size_t kLongest = 1000;
  const std::string line = withShortWords(what);
  std::cerr << program_name << ": " << (line.size() > kLongest ? inShort(line) : line) << '\n';
  return code;
}

std::terminate_handler terminate_before = nullptr;

// Ends the program where a library runs out of memory in a function that must not throw (a JSON value's destructor, a
// folder's iterator).
[[noreturn]] void endWithoutMemory() {
  bool out_of_memory = false;
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    out_of_memory = true;
  } catch (...) {
  }
  if (!out_of_memory) terminate_before();
  holdForces();
  static constexpr std::string_view kText = "filiform: out of memory inside a library, which cannot report it\n";
  // A failing write cannot be reported either.
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kText.data(), kText.size());
  ::_exit(3);
}

std::streambuf* const first_output_buffer = std::cout.rdbuf();

// If a standard descriptor is closed, the next file opened would get its number, and messages would go into that file.
void holdStandardDescriptors() {
  // Opened for the wrong direction, so that using it stays an error. open() returns the lowest free number: this one.
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(descriptor, F_GETFD) < 0 && ::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY) < 0)
      return;
}

// The text before a mark, and the text after it.
std::optional<std::pair<std::string, std::string>> cutAt(const std::string& text, std::string_view mark,
                                                         bool last = false) {
  const std::size_t at = last ? text.rfind(mark) : text.find(mark);
  if (at == std::string::npos) return std::nullopt;
  return std::pair(text.substr(0, at), text.substr(at + mark.size()));
}

// Translates CLI11's message about a refused value. Without std::regex, whose recursion overflows the stack on long
// words.
std::string plainRefusal(const CLI::App& command, const std::string& said) {
  const auto typeOf = [&command](const std::string& name) {
    const CLI::Option* const option = command.get_option_no_throw(name);
    return option == nullptr ? std::string() : option->get_type_name();
  };
  const auto isWhole = [&typeOf](const std::string& name) { return typeOf(name).find("INT") != std::string::npos; };
  constexpr std::string_view kUnread = "Could not convert: ", kExtra = "not expected: ";
  if (said.starts_with(kUnread))
    if (const auto named = cutAt(said.substr(kUnread.size()), " = "))
      return named->first + ' ' + inShort(named->second) + ": give a " +
             (isWhole(named->first) ? "whole number" : "number");
  if (const auto extra = cutAt(said, kExtra); extra && said.starts_with("The following argument"))
    return "unexpected " + inShort(extra->second);
  const auto named = cutAt(said, ": ");
  if (!named) {
    if (const auto both = cutAt(said, " excludes ")) return both->first + " cannot be given with " + both->second;
    if (const auto both = cutAt(said, " requires ")) return both->first + " needs " + both->second;
    return inShort(said);
  }
  const auto& [name, problem] = *named;
  constexpr std::string_view kValue = "Value ";
  if (const auto range = cutAt(problem, " not in range ", true); range && problem.starts_with(kValue)) {
    const auto bounds = cutAt(range->second, " to ").value();
    const auto bound = [](const std::string& text) {  // whole numbers stay unchanged
      return text.find('.') == std::string::npos ? text : formatNumber(std::stod(text));
    };
    const std::string given = name + ' ' + inShort(range->first.substr(kValue.size())) + ": give ";
    if (std::stod(bounds.second) > 1e300) return given + bound(bounds.first) + " or more";
    return given + (isWhole(name) ? "a whole number from " : "a number from ") + bound(bounds.first) + " to " +
           bound(bounds.second);
  }
  if (const auto member = cutAt(problem, " not in {", true)) {
    std::string choices;
    for (const char c : member->second.substr(0, member->second.find('}')))
      choices += c == ',' ? ", " : std::string(1, c);
    return name + ' ' + inShort(member->first) + ": choose one of " + choices;
  }
  if (const auto counts = cutAt(problem, " required but received ")) {
    const std::string wanted = counts->first.substr(counts->first.rfind(' ') + 1);
    if (wanted == "1" && counts->second != "0") return name + " may be given once";
    return name + ": give " + wanted + " values (" + typeOf(name) + "), not " + counts->second;
  }
  if (problem.ends_with(" missing"))
    if (const auto missing = cutAt(problem, " required "))
      return name + " needs a value: " + missing->second.substr(0, missing->second.size() - 8);
  return name + ": " + inShort(problem);
}

std::string without(std::string text, const std::string& part) {
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at)) text.erase(at, part.size());
  return text;
}

// Removes CLI11's value counts and check names from the help.
class PlainHelp : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text =
        without(CLI::Formatter::make_option_opts(option), " x " + std::to_string(option->get_expected()));
    for (const char* check : {":UINT", ":INT", ":FLOAT", ":NONNEGATIVE"}) text = without(text, check);
    return text;
  }
  std::string make_option_usage(const CLI::Option* option) const override {
    return without(CLI::Formatter::make_option_usage(option), "(" + std::to_string(option->get_expected()) + "x)");
  }
};

// The message for a command line that CLI11 refuses. Suggests near names for a misspelt command or option.
std::string refusalOf(const CLI::App& app, const CLI::Error& error, const std::vector<std::string>& words) {
  const auto commands = app.get_subcommands([](const CLI::App*) { return true; });
  const std::vector<CLI::App*> chosen = app.get_subcommands();
  const auto is_option = [](const std::string& word) {  // false for a negative number
    return word.size() > 1 && word[0] == '-' && word.find_first_of("0123456789.") != 1;
  };
  const auto first = std::find_if_not(words.begin(), words.end(), is_option);
  if (chosen.empty() && first != words.end()) {
    NearNames near(*first);
    for (const CLI::App* command : commands) near.offer(command->get_name());
    return "unknown command '" + escaped(*first, 80) + "'" + didYouMean(near.names()) +
           (near.names().empty() ? "; " : " ") + "'" + program_name + " --help' lists the commands";
  }
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  const std::string help = "'" + program_name + (chosen.empty() ? "" : " " + command.get_name()) + " --help'";
  for (const std::string& word : app.remaining(true)) {
    if (!is_option(word) || word == "--") continue;
    const std::string name = word.substr(0, word.find('='));
    NearNames near(name);
    for (const CLI::Option* option : command.get_options()) {
      for (const std::string& long_name : option->get_lnames()) near.offer("--" + long_name);
      for (const std::string& short_name : option->get_snames()) near.offer("-" + short_name);
    }
    return "unknown option '" + escaped(name, 80) + "'" + didYouMean(near.names()) +
           (near.names().empty() ? "; " : " ") + help + " lists the options";
  }
  return withShortWords(plainRefusal(command, error.what())) + " (see " + help + ")";
}

// While an object lives, std::cout throws where standard output cannot be written: ClosedPipe, or IoError with the
// reason.
class StrictStandardOutput {
 public:
  StrictStandardOutput() : before_(std::cout.rdbuf()), exceptions_(std::cout.exceptions()) {
    if (!isOurs()) return;
    output_.emplace("-");
    std::cout.rdbuf(output_->stream().rdbuf());
    std::cout.exceptions(std::ios::badbit);
  }
  ~StrictStandardOutput() {
    if (!output_) return;
    try {
      std::cout.flush();  // text written before a failure
    } catch (const std::exception&) {
      // The first failure is reported.
    }
    std::cout.exceptions(exceptions_);
    std::cout.rdbuf(before_);
  }
  StrictStandardOutput(const StrictStandardOutput&) = delete;
  StrictStandardOutput& operator=(const StrictStandardOutput&) = delete;

 private:
  // False where the caller of runProgram() has set a buffer of its own.
  static bool isOurs() { return std::cout.rdbuf() == first_output_buffer; }

  std::streambuf* before_;
  std::ios::iostate exceptions_;
  std::optional<Output> output_;
};

}  // namespace

std::vector<std::string> givenOptions(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    if (option->count() > 0) names.push_back(option->get_name());
  return names;
}

void endPlainlyWithoutMemory() {
  const std::terminate_handler before = std::set_terminate(endWithoutMemory);
  if (before != endWithoutMemory) terminate_before = before;
}

int runProgram(const Program& program, int argc, char** argv) {
  program_name = program.name;
  endPlainlyWithoutMemory();
  holdStandardDescriptors();
  watchInterrupts();
  std::signal(SIGPIPE, SIG_IGN);  // a closed pipe and a file-size limit become errors of write()
  std::signal(SIGXFSZ, SIG_IGN);

  CLI::App app{program.description};
  app.footer(program.footer);
  app.name(program_name);
  app.formatter(std::make_shared<PlainHelp>());
  app.require_subcommand(1);
  app.set_version_flag("--version", program_name + " " + FILIFORM_VERSION);
  Chosen chosen;
  for (const auto& add : program.commands) add(app, chosen);
  bool describes = false;  // handled before the other words
  app.add_flag("--json-usage", describes, "describe every command and option as one JSON object");
  addEnvironment(app);
  addConfigFile(app);

  const std::vector<std::string> words = withConfigFirst({argv + std::min(argc, 1), argv + argc});
  app.failure_message([&words](const CLI::App* of, const CLI::Error& error) {
    return program_name + ": " + refusalOf(*of, error, words) + originOf(*of, error.what(), words) + '\n';
  });
  if (words.empty()) {  // the help goes to stderr, because nothing was done
    std::cerr << app.help();
    return 2;
  }
  try {
    const StrictStandardOutput strict;
    int code = 0;
    try {
      if (words.size() == 1 && words[0] == "--json-usage") {
        std::cout << usageJson(app, FILIFORM_VERSION, program.others == nullptr ? "" : program.others()) << '\n';
        std::cout.flush();
        return 0;
      }
      app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
      if (!chosen) throw UsageError("--json-usage: give no other words");
      code = chosen();
    } catch (const CLI::FileError&) {
      throw IoError("--config " + inShort(app.get_config_ptr()->as<std::string>()), "cannot read the file", errno);
    } catch (const CLI::ParseError& error) {
      code = app.exit(error) == 0 ? 0 : 2;
    }
    std::cout.flush();  // throws if not all of it can be written
    return code;
  } catch (const ClosedPipe&) {
    return 128 + SIGPIPE;  // silent, like a program that the signal ends
  } catch (const Interrupted&) {
    return fail(interruptedExitCode(), "interrupted");
  } catch (const UsageError& error) {
    return fail(2, error.what());
  } catch (const IoError& error) {
    return fail(3, error.what());
  } catch (const UnknownDevice& error) {
    NearNames near(error.given());
    for (const std::string& name : error.known())
      if (name != error.given()) near.offer(name);
    return fail(2, error.what() + didYouMean(near.names()));
  } catch (const DeviceError& error) {
    return fail(3, error.what());
  } catch (const GraphicsError& error) {
    return fail(3, error.what());
  } catch (const Error& error) {  // InputError, CorruptSet, CorruptTile
    return fail(1, error.what());
  } catch (const std::bad_alloc&) {
    return fail(3, "out of memory");
  } catch (const std::system_error& error) {  // usually a thread that cannot be started
    return fail(3, "the system refused: " + error.code().message());
  } catch (const std::exception& error) {
    return fail(3, std::string("internal error: ") + error.what() + " (please report this)");
  }
}

}  // namespace filiform::tools
