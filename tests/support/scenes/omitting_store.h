// A store that omits one tile of each cell's list, as a damaged set would.
#pragma once

#include "index/set/forwarding_store.h"

namespace filiform::test {

// Thread rule: as the store that it forwards to.
class OmittingStore final : public ForwardingStore {
 public:
  using ForwardingStore::ForwardingStore;
  CellDetail loadCellDetail(std::uint32_t id) const override {
    CellDetail detail = store_.loadCellDetail(id);
    detail.tiles.pop_back();
    return detail;
  }
};

}  // namespace filiform::test
