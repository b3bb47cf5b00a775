// Neurons as tracing programs write them: on a voxel lattice, or with a depth that is less accurate than the plane.
// Functions without state; the same arguments give the same samples on every machine.
#pragma once

#include "tools/synthetic/synthetic_neuron.h"

#include <cstdint>
#include <string>

namespace filiform::tools {

// Moves each neurite from voxel to voxel: steps of 1, 1.4 or 1.7 voxels, with turns of 35 to 90 degrees everywhere.
// Somata (type 1) keep their place. Throws UsageError unless voxel_um is at least 0.01 and finite. O(length /
// voxel_um).
Neuron onLattice(const Neuron& neuron, double voxel_um);

// Moves the depth (z) of each sample, except those of somata, by a normal deviate with standard deviation `rms_um`.
// Throws UsageError unless rms_um is >= 0 and finite. O(samples).
Neuron withJitteredDepth(const Neuron& neuron, double rms_um, std::uint64_t seed);

// Neuron `number` of a family of traces: the column's neuron of this seed and number. Even numbers lie on a lattice of
// 0.3 to 2 um; the depth of odd numbers jitters by 0.3 to 1.5 um. The description says which.
Neuron drawTrace(std::uint64_t seed, std::uint64_t number);

}  // namespace filiform::tools
