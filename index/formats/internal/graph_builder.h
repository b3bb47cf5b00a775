// Builds a Cell from the nodes and links of one graph file. It maps ids to ranks, applies units, checks the range of
// the grid, and keeps records of all losses. Thread rule: thread-compatible.
#pragma once

#include "index/cell/cell.h"
#include "index/formats/swc.h"
#include "index/formats/swc/internal/id_table.h"
#include "index/formats/swc/internal/swc_graph.h"
#include "index/reports/input_report.h"

#include <cstdint>
#include <string_view>
#include <vector>

namespace filiform::internal {

class GraphBuilder {
 public:
  // Throws UsageError as SwcReader does.
  explicit GraphBuilder(const SwcOptions& options);

  // Adds a node in the unit of the file; an unknown radius is NaN. An odd radius (index/cell/radius.h) is kept. A node
  // is dropped, with a record, if it is not finite, out of range, or has an id already used. `token` goes into that
  // record. Returns whether the node was kept. O(1) expected.
  bool node(std::int64_t id, const Vector3d& position, double radius, std::uint16_t type, std::uint64_t line,
            std::string_view token);
  // Drops a node that cannot be read.
  void dropNode(InputCode code, std::uint64_t line, std::string_view token);
  // Counts a point for which another sample stands. The caller remarks why.
  void mergePoint() {
    ++candidates_;
    ++merged_;
  }
  // Adds a link between two ids; their nodes may come later.
  void link(std::int64_t a, std::int64_t b, std::uint64_t line);
  // Cuts a link that cannot be read.
  void cutLink(InputCode code, std::uint64_t line, std::string_view token);
  void remark(InputCode code, std::uint64_t line, std::string_view token) { book_.remark(code, line, token); }
  // Refuses the whole input. Only the first refusal counts.
  void refuse(InputCode code, std::uint64_t line, std::string_view token);
  bool refused() const { return refused_; }
  // Sets the radius of a node, rounded to a float; no effect if the node does not exist.
  void setRadius(std::int64_t id, double radius, std::uint64_t line);
  void setType(std::int64_t id, std::uint16_t type);

  // Resolves the links and fills `cell`: all members except source and digest. Error messages name `file`. Throws
  // ConservationError, and InputError for more than 2^32-2 samples and links. O(nodes + links) expected.
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
  std::uint64_t candidates_ = 0, unreadable_ = 0, links_given_ = 0, merged_ = 0;
  bool refused_ = false;
};

}  // namespace filiform::internal
