#include "viewer/window/panels/internal/network_text.h"

#include "viewer/window/settings/internal/text_format.h"

namespace filiform::internal {

namespace {

constexpr double kSlow_s = 2;

}  // namespace

std::string networkText(const RemoteCounters& network) {
  if (network.lost)
    return format("the network is lost: no answer for %.0f s; missing parts are asked for again until they come",
                  network.silent_s);
  if (network.silent_s >= kSlow_s)
    return format("the network is slow: no answer for %.0f s; missing parts are on their way", network.silent_s);
  return {};
}

}  // namespace filiform::internal
