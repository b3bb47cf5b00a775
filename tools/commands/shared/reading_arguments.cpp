#include "tools/commands/shared/reading_arguments.h"

#include "index/errors.h"
#include "index/formats/neuroglancer/object_ids.h"
#include "index/text.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>

namespace filiform::tools {

void ReadingArguments::apply(InputOptions& options) const {
  options.versions = version == "both"     ? MorphologyVersion::both
                     : version == "source" ? MorphologyVersion::source
                                           : MorphologyVersion::cng;
  options.remote = remote->options();
  if (ids.empty()) return;
  std::ifstream in(ids, std::ios::binary);
  if (!in) throw IoError("--ids " + inShort(ids), "cannot open", errno);
  const std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  std::vector<std::uint64_t> wanted = readObjectIds(text, ids);
  std::sort(wanted.begin(), wanted.end());
  wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
  options.ids = std::make_shared<const std::vector<std::uint64_t>>(std::move(wanted));
}

std::shared_ptr<ReadingArguments> addReadingArguments(CLI::App& command) {
  auto a = std::make_shared<ReadingArguments>();
  command
      .add_option(
          "--version", a->version,
          "of neurons that a NeuroMorpho archive holds twice, read the standardised one (cng), the source or both")
      ->check(CLI::IsMember({"cng", "source", "both"}))
      ->capture_default_str();
  command.add_option("--ids", a->ids, "of precomputed skeletons, read the objects in this file, one id a line")
      ->type_name("FILE");
  a->remote = addRemoteArguments(command);
  return a;
}

}  // namespace filiform::tools
