#include "tools/lab/bench/index/box_peers.h"
#include "tools/lab/bench/index/embree_peer.h"
#include "tools/lab/bench/index/midpoint_peers.h"
#include "tools/lab/bench/peers.h"

#include <stdexcept>
#include <utility>

namespace filiform::tools {

std::vector<Peer> peers() { return {cgalPeer(), boostPeer(), embreePeer(), flannPeer(), nanoflannPeer()}; }

Peer racedWith(Peer peer, const std::string& setting) {
  for (std::size_t i = 0; i < peer.settings.size(); ++i)
    if (peer.settings[i].name == setting) {
      peer.raced = i;
      return peer;
    }
  throw std::logic_error(peer.name + " has no setting " + setting);
}

}  // namespace filiform::tools
