#include "tools/bench/peers.h"

#include "tools/bench/box_peers.h"
#include "tools/bench/embree_peer.h"
#include "tools/bench/midpoint_peers.h"

namespace filiform::tools {

std::vector<Peer> peers() { return {cgalPeer(), boostPeer(), embreePeer(), flannPeer(), nanoflannPeer()}; }

}  // namespace filiform::tools
