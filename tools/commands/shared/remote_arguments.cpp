#include "tools/commands/shared/remote_arguments.h"

#include "index/errors.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "tools/program/interruption.h"
#include "tools/words/numbers.h"
#include "tools/words/token.h"

#include <cstdlib>

#include <CLI/CLI.hpp>

namespace filiform::tools {

namespace {

constexpr const char* kRemoteGroup =
    "For a SET at an address (http://HOST/v1/sets/NAME, https://HOST/PATH/NAME.fil or s3://BUCKET/PATH/NAME.fil)";

}  // namespace

RemoteOptions RemoteArguments::options() const {
  RemoteOptions options;
  const char* const token = std::getenv("FILIFORM_TOKEN");
  if (!token_file.empty())
    options.token = readTokenFile(token_option, token_file);
  else if (token != nullptr && *token != '\0')
    options.token = tokenIn(token, "FILIFORM_TOKEN");
  options.cache_folder = cache;
  if (!cache_size.empty()) options.cache_bytes = parseBytes("--cache-size", cache_size);
  if (connections != 0) options.connections = connections;
  options.cancel = &interruptFlag();
  return options;
}

std::shared_ptr<RemoteArguments> addRemoteArguments(CLI::App& command, const std::string& token_option) {
  auto a = std::make_shared<RemoteArguments>();
  a->token_option = token_option;
  command
      .add_option(token_option, a->token_file,
                  "send the token in the first line of this file, only to the set's own host; default: the variable "
                  "FILIFORM_TOKEN")
      ->type_name("FILE")
      ->group(kRemoteGroup);
  command
      .add_option("--cache", a->cache, "keep what is read in this folder, for later commands; default: keep nothing")
      ->type_name("DIR")
      ->group(kRemoteGroup);
  command
      .add_option("--cache-size", a->cache_size,
                  "remove what was not used for longest when the folder is larger than this; default: 4GiB")
      ->type_name("BYTES")
      ->group(kRemoteGroup);
  command.add_option("--connections", a->connections, "make at most this many requests at once, 1 to 64; default: 32")
      ->check(CLI::Range(1, 64))
      ->type_name("N")
      ->group(kRemoteGroup);
  return a;
}

bool isRemoteOption(const std::string& option) {
  return option == "--token-file" || option == "--cache" || option == "--cache-size" || option == "--connections";
}

void refuseAddress(const std::string& option, const std::string& path) {
  if (isAddress(path))
    throw UsageError(option + " " + inShort(path) + ": a set is written to a folder, not to an address" +
                     (path.starts_with("s3:") ? "; make it in a folder, then send it with filiform push" : ""));
}

}  // namespace filiform::tools
