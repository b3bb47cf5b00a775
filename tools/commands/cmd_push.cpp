// filiform push: copies a tile set to an object store.
#include "index/text.h"
#include "tools/commands/commands.h"
#include "tools/commands/shared/copy_report.h"
#include "tools/program/progress_option.h"

#include <iostream>
#include <memory>

#include <CLI/CLI.hpp>

namespace filiform::tools {

void addPush(CLI::App& app, Chosen& chosen) {
  struct Arguments {
    std::string set, address;
    bool json = false;
  };
  auto a = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("push", "Copy a tile set to S3-compatible storage");
  command->footer(
      "Example:\n  filiform push column.fil s3://BUCKET/lab/column.fil\n"
      "Only files that are not there are sent: an interrupted push goes on where it stopped. Readers see the new set "
      "when all of it is there; files of older revisions stay. Endpoint, region and keys come from AWS_ENDPOINT_URL, "
      "AWS_REGION, AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or from ~/.aws.");
  command->add_option("SET", a->set, "tile set, a folder")->required();
  command->add_option("ADDRESS", a->address, "where to: s3://BUCKET/PATH/NAME.fil")->required();
  command->add_flag("--json", a->json, "print one JSON object");
  addProgressOption(*command);
  command->callback([a, &chosen] {
    chosen = [a] {
      const CopyResult result = copyWithProgress(
          "push", {}, [&](const CopyOptions& options) { return pushSet(a->set, a->address, options); });
      printCopy(a->address, "sent", result, a->json);
      if (!a->json && !result.before.empty() && result.before != result.revision)
        std::cout << "  before: " << result.before
                  << "; its files stay at the address, until filiform tidy removes them\n";
      return 0;
    };
  });
}

}  // namespace filiform::tools
