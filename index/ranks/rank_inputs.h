// RankInputs: deals the inputs of an ingest to ranks, and gathers what each has read. Thread rule: as Ranks.
#pragma once

#include "index/circuits/attribute_table.h"
#include "index/circuits/circuit.h"
#include "index/circuits/placements.h"
#include "index/input/input.h"
#include "index/ranks/ranks.h"

#include <cstdint>
#include <functional>
#include <vector>

namespace filiform::tools {

class RankInputs {
 public:
  // Compares the lists of inputs of all ranks, then keeps the part of this rank. Keeps references; `placed` and
  // `circuit` may be null. Throws IoError on a rank that lacks an input of another, and what Ranks throws.
  RankInputs(Ranks& ranks, Input& input, PlacedCells* placed, CircuitCells* circuit);

  // After the last cell: rank 0 gets the reports of all; `attributed` may be null. Throws IoError on a rank that could
  // not read an input although another can.
  void gather(AttributedCells* attributed);

 private:
  void compareLists();
  void compareReadable();

  Ranks& ranks_;
  Input& input_;
  PlacedCells* placed_;
};

}  // namespace filiform::tools
