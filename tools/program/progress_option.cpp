#include "tools/program/progress_option.h"

#include "tools/program/progress.h"

#include <string>

#include <CLI/CLI.hpp>

namespace filiform::tools {

void addProgressOption(CLI::App& command) {
  command
      .add_option_function<std::string>(
          "--progress",
          [](const std::string& style) {
            setProgressStyle(style == "json"   ? ProgressStyle::json
                             : style == "none" ? ProgressStyle::none
                                               : ProgressStyle::automatic);
          },
          "show progress on standard error: auto, a line if it is a terminal; json, a JSON object a line; none")
      ->check(CLI::IsMember({"auto", "json", "none"}))
      ->type_name("STYLE")
      ->default_str("auto");
}

}  // namespace filiform::tools
