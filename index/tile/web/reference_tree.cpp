// Without CGAL, which only tests and benchmarks ask for. Stands in for reference_tree.cpp in the preset `web`.
#include "index/tile/reference_tree.h"

#include "index/errors.h"

namespace filiform {

std::unique_ptr<TileEngine> makeReferenceTree(std::shared_ptr<const Tile>, SomeRuns) {
  throw UsageError("search engine \"cgal\" is not in this build; use packed");
}

}  // namespace filiform
