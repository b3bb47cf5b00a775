// Tile sets in a temporary folder with the routes of the service over them, without a socket.
#pragma once

#include "tests/support/temp_folder.h"
#include "tools/serve/routes/routes.h"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace filiform::test {

// `column.fil`: ten random neurons of layers 0 to 9, with levels of detail. `fork.fil`: the cells fork (samples 1 to 5)
// and square (with a loop).
class ServedSets {
 public:
  explicit ServedSets(tools::AccessRules rules = {}, std::uint64_t budget_bytes = 64 << 20);

  // Asks the routes. The header Host is localhost unless `headers` has another.
  tools::Answer get(const std::string& target, std::map<std::string, std::string> headers = {}) const;
  tools::Answer ask(const std::string& method, const std::string& target, std::map<std::string, std::string> headers,
                    const std::string& body = "") const;
  // The answer's JSON. Fails the test if the status is not 200.
  nlohmann::json json(const std::string& target) const;

  std::string client;  // address of who asks
  std::string user;    // whom a proxy names
  const TempFolder folder;
  std::optional<tools::SetShelf> shelf;
  tools::Access access;
  tools::Metrics metrics;
  std::optional<tools::Service> service;
  std::optional<tools::Routes> routes;
  mutable std::vector<std::string> log;
};

// The content of an answer, also if it comes from a file.
std::string contentOf(const tools::Answer& answer);

// One record of the rows that an .npy answer holds.
struct NpyRow {
  std::uint32_t query, rank, cell, segment;
  double distance, x, y, z;
  std::int64_t sample;
  bool exact;
  std::int32_t type;
  double radius, t;
};
// Reads the rows of an answer of nearest or box. Throws std::runtime_error if it is malformed.
std::vector<NpyRow> npyRows(const std::string& bytes);
// An array of N x 3 '<f8' in C order.
std::string npyOf(const std::vector<Vector3d>& points);

}  // namespace filiform::test
