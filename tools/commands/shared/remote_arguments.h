// The options of commands that read a tile set: how it is read from an address. Thread rule: values.
#pragma once

#include "index/remote/remote_options.h"

#include <memory>
#include <string>

namespace CLI {
class App;
}

namespace filiform::tools {

struct RemoteArguments {
  std::string token_file, cache, cache_size;
  unsigned connections = 0;                   // 0: the default of RemoteOptions
  std::string token_option = "--token-file";  // that gives token_file

  // Reads the token from the file, or else from the environment variable FILIFORM_TOKEN. A signal cancels reads. Throws
  // as readTokenFile() and tokenIn().
  RemoteOptions options() const;
};

// Adds --token-file (or another name), --cache, --cache-size and --connections, in a group of their own in the help.
std::shared_ptr<RemoteArguments> addRemoteArguments(CLI::App& command,
                                                    const std::string& token_option = "--token-file");

// True for the options that addRemoteArguments() adds under their usual names.
bool isRemoteOption(const std::string& option);

// For an option that names a set to be written. Throws UsageError if it is an address.
void refuseAddress(const std::string& option, const std::string& path);

}  // namespace filiform::tools
