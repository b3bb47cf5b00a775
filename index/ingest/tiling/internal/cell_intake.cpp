#include "index/ingest/tiling/internal/cell_intake.h"

#include "index/errors.h"
#include "index/set/internal/cells_file.h"

#include <utility>

namespace filiform::internal {
namespace {

constexpr std::uint64_t kBytesOfCell = 512;  // without its names; measured with margins, since vectors grow by halves

std::uint64_t heapBytes(const std::string& text) { return text.size() < 16 ? 0 : text.size() + 32; }

}  // namespace

void CellIntake::take(TakenCell cell) {
  const std::uint64_t size = cell.detail.size();
  details_.append({reinterpret_cast<const std::uint8_t*>(&size), sizeof size});
  details_.append(cell.detail);
  CellRecord& record = cell.record;
  segments_ += record.segments + record.isolated;
  bytes_ += kBytesOfCell + 4 * heapBytes(record.source) + 3 * heapBytes(record.name);
  given_names_.push_back(std::move(record.name));
  digests_.push_back(cell.digest);
  const auto id = static_cast<std::uint32_t>(records_.size());
  for (SomaRoot soma : cell.somata) {
    soma.cell = id;
    somata_.push_back(soma);
  }
  if (for_others_) {
    for (const CellAttribute& attribute : cell.attributes) bytes_ += 128 + attribute.name.size();
    given_attributes_.push_back(std::move(cell.attributes));
  } else {
    attributes_.add(id, cell.attributes);
  }
  records_.push_back(std::move(record));
}

GridBox CellIntake::bounds() const {
  GridBox bounds;
  for (const CellRecord& cell : records_)
    if (!cell.bounds.empty()) bounds.extend(cell.bounds);
  return bounds;
}

void CellIntake::finish() {
  details_.close();
  std::vector<std::string> sources;
  sources.reserve(records_.size());
  for (const CellRecord& record : records_) sources.push_back(record.source);
  std::vector<std::string> names = cellNames(sources, given_names_);
  given_names_ = {};
  for (std::size_t i = 0; i < names.size(); ++i) records_[i].name = std::move(names[i]);
}

void CellIntake::limitDetails(std::uint64_t most_bytes) {
  if (details_.bytes() > most_bytes) details_.spill();
}

void CellIntake::readDetails(const std::function<void(std::uint32_t cell, ByteSpan detail)>& use) {
  ByteChain::Reader rest(details_, true);
  for (std::uint32_t cell = 0; cell < records_.size(); ++cell) {
    std::uint64_t size = 0;
    rest.read(reinterpret_cast<std::uint8_t*>(&size), sizeof size);
    Bytes bytes(size);
    rest.read(bytes.data(), size);
    use(cell, ByteSpan(bytes).subspan(1));  // after the number of tiles, 0
  }
}

}  // namespace filiform::internal
