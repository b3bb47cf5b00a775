// Adds to contact sites what only whole cells tell: places, sample ids, paths to somata. Thread rule: pure functions.
#pragma once

#include "index/contacts/contact_site.h"
#include "index/query/cell_graph.h"

#include <functional>
#include <span>
#include <vector>

namespace filiform::internal {

// By sample: the length of the path to the first sample of type 1, as CellPaths::lengths_um() gives it; infinite if no
// path leads there. Empty if no sample has type 1. Requires types. O(samples); O(samples log samples) for cells with
// loops, or with parents after their children.
std::vector<double> soma_lengths_um(const CellGraph& cell);

// Reads the cells of all sites, and completes both sides. Throws what CellPass throws.
void addPlaces(const TileStore& store, std::span<ContactSite> sites, std::uint64_t memory_bytes, unsigned threads,
               const std::function<void()>& check);

}  // namespace filiform::internal
