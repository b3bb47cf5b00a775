// filiform pull: copies a tile set from an address to a folder.
#include "tools/commands/commands.h"
#include "tools/commands/shared/copy_report.h"
#include "tools/commands/shared/remote_arguments.h"
#include "tools/program/progress_option.h"

#include <memory>

#include <CLI/CLI.hpp>

namespace filiform::tools {

void addPull(CLI::App& app, Chosen& chosen) {
  struct Arguments {
    std::string address, out, token_file;
    bool force = false, json = false;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("pull", "Copy a tile set from an address to a folder");
  command->footer(
      "Example:\n  filiform pull s3://BUCKET/lab/column.fil -o column.fil\n"
      "Every file is checked. Only files that are not there are read: an interrupted pull goes on where it stopped.");
  command->add_option("ADDRESS", a->address, "s3://BUCKET/PATH/NAME.fil, or the address of a set on a web server")
      ->required();
  command->add_option("-o,--output", a->out, "folder of the tile set")->required()->type_name("SET");
  command->add_flag("--force", a->force, "replace another set in the folder");
  command
      ->add_option("--token-file", a->token_file, "send the token in this file; default: the variable FILIFORM_TOKEN")
      ->type_name("FILE");
  command->add_flag("--json", a->json, "print one JSON object");
  addProgressOption(*command);
  command->callback([a, &chosen] {
    chosen = [a] {
      refuseAddress("--output", a->out);
      RemoteArguments remote;
      remote.token_file = a->token_file;
      const CopyResult result =
          copyWithProgress("pull", {.remote = remote.options(), .force = a->force},
                           [&](const CopyOptions& options) { return pullSet(a->address, a->out, options); });
      printCopy(a->out, "read", result, a->json);
      return 0;
    };
  });
}

}  // namespace filiform::tools
