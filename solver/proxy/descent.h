// Basic proxy solver: descent along several paths (Raya et al. 2011, section 3.1).
//
// From the active element (segment or node), depth first, along every path on which the distance to the probe h falls:
//
//   segment: skip if visited; mark as visited. q = closest point to h; q becomes the best proxy if it is strictly
//   nearer.
//            q at an end node: continue from that node, unless visited. q in the interior: this branch ends.
//   node:    skip if visited; mark as visited. Test every segment at the node, in the order of ids.
//
// The proxy becomes the best point found. If no point is strictly nearer, it keeps its place, bit for bit. A place
// inside a segment starts with that segment; a place at a node starts with all segments at that node. A segment of
// length zero is passed: q is the end from which it was not entered. A search that starts on such a segment continues
// from both ends.
//
// The method finds only local minima of the distance: at a concave elbow the proxy stays until the hand pulls past the
// corner. Bounds, continuation in later ticks, frontiers and invariants: internal/bounded_search.h. Thread rule: haptic
// thread only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <memory>

namespace filiform {

// Uses only max_visited and pool_nodes. Requires checked parameters, as makeProxySolver() does.
std::unique_ptr<ProxySolver> makeDescent(const SolverParameters& parameters);

}  // namespace filiform
