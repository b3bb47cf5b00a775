#include "tests/support/devices/bridge_process.h"

#include "tests/support/folders.h"

#include <vector>

namespace filiform::test {

namespace {

std::vector<std::string> wordsOf(const std::string& address, const std::string& name) {
  std::vector<std::string> words{bridgeProgram(name)};
  if (!address.empty()) words.push_back(address);
  return words;
}

}  // namespace

BridgeProcess::BridgeProcess(const std::string& address, const std::string& log, const std::string& name)
    : StartedProcess(wordsOf(address, name), "", {"FILIFORM_BRIDGE_LOG=" + log}) {}

std::string bridgeProgram(const std::string& name) { return inBuild("bridges/" + name); }

std::string refusalOf(const BridgeOptions& options) {
  try {
    const BridgeDevice device(options);
    return "";
  } catch (const DeviceError& error) {
    return error.what();
  }
}

}  // namespace filiform::test
