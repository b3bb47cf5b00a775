// Basic proxy solver: multi-path descent (Raya et al. 2011, section 3.1; DESIGN 5.1).
//
// From the active element (segment, or node), depth first, along every path on which the distance to the probe h falls:
//
//   segment: skip if visited, mark. q = closest point to h; the best proxy becomes q if q is strictly nearer.
//            q at an end node: go on from that node, unless visited. q in the interior: this branch ends.
//   node:    skip if visited, mark. Every incident segment, in the order of identity.
//
// The proxy becomes the best point found; where nothing is strictly nearer it stays, to the last bit.
// A place in the interior of a segment starts with that segment, a place at a node with that node (so with all its
// segments). A segment of equal ends is no wall: q is the end that was not entered from. A search that begins on one
// goes on from both ends.
//
// It finds local minima of the distance only: at a concave elbow it stays until the hand pulls past the corner.
// Bounds, resuming, frontiers and invariants: internal/bounded_search.h. Thread rule: haptic thread only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <memory>

namespace filiform {

// Uses max_visited alone; makeProxySolver() has checked the parameters.
std::unique_ptr<ProxySolver> makeDescent(const SolverParameters& parameters);

}  // namespace filiform
