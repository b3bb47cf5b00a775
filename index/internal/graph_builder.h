// Nodes and links of one graph file while it is read: ids to ranks, units, the range of the grid, records, and the
// count that nothing was lost without one. Thread-compatible.
#pragma once

#include "index/cell.h"
#include "index/input_report.h"
#include "index/internal/id_table.h"
#include "index/internal/swc_graph.h"
#include "index/swc.h"

#include <cstdint>
#include <string_view>
#include <vector>

namespace filiform::internal {

class GraphBuilder {
 public:
  // Throws UsageError as SwcReader.
  explicit GraphBuilder(const SwcOptions& options);

  // A node in the unit of the file; an unknown radius is a NaN. Not finite, out of range, an id that is there already:
  // dropped, with a record. `token` is for that record. O(1) expected.
  void node(std::int64_t id, const Vector3d& position, double radius, std::uint16_t type, std::uint64_t line,
            std::string_view token);
  // A node that cannot be read.
  void dropNode(InputCode code, std::uint64_t line, std::string_view token);
  // A link between ids, which may come later.
  void link(std::int64_t a, std::int64_t b, std::uint64_t line);
  // A link that cannot be read.
  void cutLink(InputCode code, std::uint64_t line, std::string_view token);
  void remark(InputCode code, std::uint64_t line, std::string_view token) { book_.remark(code, line, token); }
  // The whole input: nothing that was read counts. The first refusal stands.
  void refuse(InputCode code, std::uint64_t line, std::string_view token);
  bool refused() const { return refused_; }
  // The radius of a node that was taken; nothing where there is none.
  void setRadius(std::int64_t id, double radius, std::uint64_t line);
  void setType(std::int64_t id, std::uint16_t type);

  // Resolves the links and fills `cell` (all but source and digest). `file` is for messages. Throws ConservationError,
  // InputError beyond 2^32-2 samples and links. O(nodes + links) expected.
  InputReport finish(std::string_view file, Cell& cell);

 private:
  struct Link {
    std::int64_t a, b;
    std::uint64_t line;
  };
  float radiusFrom(double radius, std::uint64_t line, std::string_view token);

  SwcOptions options_;
  RecordBook book_;
  Cell cell_;
  IdTable ids_;
  std::vector<Link> links_;
  std::uint64_t candidates_ = 0, unreadable_ = 0, links_given_ = 0;
  bool refused_ = false;
};

}  // namespace filiform::internal
