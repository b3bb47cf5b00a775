// Force shading: the proxy is where the *shaded* direction of the structure is across the pull (Ruspini et al. 1997,
// extended to branches by Raya et al. 2011; DESIGN 5.3). A baseline to compare with.
//
// The closest-point condition (h - p) . d = 0 of a segment is solved with a direction that is interpolated between
// those of its ends, so that it turns evenly along the structure instead of at corners. On the segment from A to B,
// with p(u) = A + u (B - A):
//
//   f(u) = (h - p(u)) . ((1-u) d_A + u d_B)          a quadratic in u, solved exactly; f > 0: on towards B
//   d_A, d_B: means of unit directions, each oriented through the node, of three incident segments: this one, and the
//   two whose closest points to h are nearest (ties: lower identity); where there are fewer, of those there are
//
// From the old u the proxy goes the way that f says, to the first zero of f. Where there is none before an end it
// leaves by that node: into the incident segment that is nearest to h, if f there leads on, away from the node; else it
// rests at the node. At most kMostShadedSegments are walked in a tick, and at most max_visited incident segments looked
// at beside them (capped: the proxy rests where it has come to, and goes on from there on the next tick).
//
// A segment of equal ends has no direction: it counts for none, and where it is the nearest way on it is passed.
// A node whose home is absent is a frontier: it is reported, its direction is the segment's own, and nothing leaves by
// it. The direction field is no gradient: the distance to h may rise, the proxy may jump, and with h at rest it may
// even go in circles, a bounded number of segments a tick.
//
// Invariants (each a test): equality with a literal oracle, bit for bit, in every tiling; the bounds; undo() exact;
// undo, load and repeat converge to the whole graph's answer; a probe that is not finite changes nothing. Thread rule:
// haptic thread only.
#pragma once

#include "solver/proxy/proxy_solver.h"

#include <memory>

namespace filiform {

inline constexpr std::uint32_t kMostShadedSegments = 64;

// Uses max_visited alone; makeProxySolver() has checked the parameters. SolverStep::visited counts the segments on
// which f was solved.
std::unique_ptr<ProxySolver> makeForceShading(const SolverParameters& parameters);

}  // namespace filiform
