#include "tests/support/servers/served_sets.h"

#include "index/ingest/ingest.h"
#include "index/input/input.h"
#include "tests/support/scenes/random_cells.h"

#include <cstring>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

namespace filiform::test {

ServedSets::ServedSets(tools::AccessRules rules, std::uint64_t budget_bytes) : access(std::move(rules)) {
  std::vector<Cell> cells = randomColumn(5, 10, 400, 300);
  for (std::size_t i = 0; i < cells.size(); ++i)
    cells[i].attributes = {{"layer", static_cast<std::int64_t>(i)}, {"mtype", i % 2 == 0 ? "L5 even" : "L5 odd"}};
  CellList column(std::move(cells));
  ingest(column, folder / "column.fil", {.capacity = 128, .levels = true});
  writeBytes(folder / "fork.swc",
             "1 1 0 0 0 5 -1\n2 3 10 0 0 2 1\n3 3 13 4 0 1 2\n4 3 10 -10 0 1 2\n5 4 10 -20 0 0.5 4\n");
  writeBytes(folder / "square.edges",
             "node 1 0 0 7\nnode 2 4 0 7\nnode 3 4 4 7\nnode 4 0 4 7\nnode 5 -3 4 7\n"
             "edge 1 2\nedge 2 3\nedge 3 4\nedge 4 1\nedge 4 5\n");
  Input input({folder / "fork.swc", folder / "square.edges"});
  ingest(input, folder / "fork.fil", {.capacity = 2});
  shelf.emplace(tools::shelfEntries({folder / "column.fil", folder / "fork.fil"}), budget_bytes);
  service.emplace(tools::Service{*shelf, access, metrics, "0.0.0"});
  routes.emplace(*service, [this](const std::string& line) { log.push_back(line); });
}

tools::Answer ServedSets::ask(const std::string& method, const std::string& target,
                              std::map<std::string, std::string> headers, const std::string& body) const {
  headers.emplace("host", "localhost");
  tools::Request request;
  request.method = method;
  request.target = target;
  request.headers = std::move(headers);
  request.body = body;
  request.client = client;
  request.user = user;
  return routes->answer(request).answer;
}

tools::Answer ServedSets::get(const std::string& target, std::map<std::string, std::string> headers) const {
  return ask("GET", target, std::move(headers));
}

nlohmann::json ServedSets::json(const std::string& target) const {
  const tools::Answer answer = get(target);
  EXPECT_EQ(answer.status, 200u) << target << ": " << answer.body;
  return nlohmann::json::parse(answer.body);
}

std::string contentOf(const tools::Answer& answer) {
  if (!answer.file) return answer.body;
  std::vector<std::uint8_t> bytes(answer.file->bytes);
  answer.file->set->read(answer.file->file, answer.file->first, bytes);
  return {bytes.begin(), bytes.end()};
}

std::vector<NpyRow> npyRows(const std::string& bytes) {
  if (bytes.size() < 10) throw std::runtime_error("no .npy header");
  const std::size_t header = static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  constexpr std::size_t kRecord = 77;
  const std::size_t start = 10 + header;
  if (start % 64 != 0 || (bytes.size() - start) % kRecord != 0) throw std::runtime_error("wrong .npy sizes");
  std::vector<NpyRow> rows;
  for (std::size_t at = start; at < bytes.size(); at += kRecord) {
    NpyRow row{};
    const char* raw = bytes.data() + at;
    const auto next = [&raw](auto& value) {
      std::memcpy(&value, raw, sizeof value);
      raw += sizeof value;
    };
    next(row.query), next(row.rank), next(row.distance), next(row.x), next(row.y), next(row.z);
    next(row.cell), next(row.segment), next(row.sample), next(row.exact);
    next(row.type), next(row.radius), next(row.t);
    rows.push_back(row);
  }
  return rows;
}

std::string npyOf(const std::vector<Vector3d>& points) {
  std::string header =
      "{'descr': '<f8', 'fortran_order': False, 'shape': (" + std::to_string(points.size()) + ", 3), }";
  header.append(63 - (10 + header.size()) % 64, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += static_cast<char>(header.size() & 0xFF);
  bytes += static_cast<char>(header.size() >> 8);
  bytes += header;
  for (const Vector3d& p : points)
    for (int axis = 0; axis < 3; ++axis) {
      char raw[8];
      const double value = p[axis];
      std::memcpy(raw, &value, 8);
      bytes.append(raw, 8);
    }
  return bytes;
}

}  // namespace filiform::test
