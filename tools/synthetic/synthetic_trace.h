// Neurons as tracing programs leave them: on a voxel lattice, or with a depth that is less sure than the plane.
// Functions without state; the same arguments give the same samples on every machine.
#pragma once

#include "tools/synthetic/synthetic_neuron.h"

#include <cstdint>
#include <string>

namespace filiform::tools {

// Each neurite becomes a walk from voxel to voxel: steps of 1, 1.4 or 1.7 voxels, with turns of 35 to 90 degrees
// everywhere. Somata (type 1) keep their place. Throws UsageError unless voxel_um is 0.01 or more and finite. O(length
// / voxel_um).
Neuron onLattice(const Neuron& neuron, double voxel_um);

// The depth (z) of each sample but the somata's moves by a normal deviate of that size, each by its own. Throws
// UsageError unless rms_um is >= 0 and finite. O(samples).
Neuron withJitteredDepth(const Neuron& neuron, double rms_um, std::uint64_t seed);

// Neuron `number` of a family of traces: the column's neuron of that seed and number, by turns (even numbers) on a
// lattice of 0.3 to 2 um and (odd numbers) with a depth that jitters by 0.3 to 1.5 um. The description says which.
Neuron drawTrace(std::uint64_t seed, std::uint64_t number);

}  // namespace filiform::tools
