// Parts of the inputs, for processes that read together.
#include "index/input/input.h"
#include "index/input/internal/input_state.h"
#include "index/reports/internal/report_bytes.h"

#include <algorithm>
#include <utility>

namespace filiform {

using internal::InputItem;

std::size_t internal::InputState::startOfSource(std::uint64_t at) const {
  std::size_t start = std::min<std::uint64_t>(at, items.size());
  while (start > 0 && start < items.size() && items[start].source == items[start - 1].source) --start;
  return start;
}

std::vector<std::uint64_t> Input::sizes() const {
  std::vector<std::uint64_t> sizes;
  sizes.reserve(state_->items.size());
  for (const State::Item& item : state_->items) sizes.push_back(state_->inputItem(item).bytes);
  return sizes;
}

void Input::keepPart(unsigned part, unsigned count) {
  const std::vector<std::uint64_t> sizes = this->sizes();
  double all = 0;
  for (const std::uint64_t size : sizes) all += static_cast<double>(size + 1);
  const auto boundary = [&](unsigned p) {
    double before = 0;
    std::uint64_t at = 0;
    for (; at < sizes.size() && before < all / count * p; ++at) before += static_cast<double>(sizes[at] + 1);
    return p == count ? sizes.size() : at;
  };
  keepOnly(boundary(part), boundary(part + 1));
}

void Input::keepOnly(std::uint64_t begin, std::uint64_t end) {
  state_->begin_at = state_->startOfSource(begin);
  state_->end_at = state_->startOfSource(end);
  state_->bytes_total = 0;
  for (std::size_t i = state_->begin_at; i < state_->end(); ++i) {
    const InputItem item = state_->inputItem(state_->items[i]);
    const bool packed = item.entry != nullptr && item.entry->packed_bytes > 0;
    state_->bytes_total += packed ? item.entry->packed_bytes : item.bytes;
  }
  rewind();
}

std::vector<Input::Unreadable> Input::unreadable() const {
  std::vector<Unreadable> found;
  for (std::uint32_t row = 0; row < state_->rows.size(); ++row) {
    const SourceReport& report = state_->rows[row];
    if (internal::isUnreadable(report.report) && report.entries.empty())
      found.push_back({row, internal::kNoEntry, report.file, refusalReason(report.report)});
    for (std::uint32_t entry = 0; entry < report.entries.size(); ++entry)
      if (internal::isUnreadable(report.entries[entry].report))
        found.push_back(
            {row, entry, report.file + "/" + report.entries[entry].entry, refusalReason(report.entries[entry].report)});
  }
  return found;
}

std::optional<std::string> Input::tryToRead(const Unreadable& input) {
  State& state = *state_;
  for (State::Item& item : state.items) {
    if (item.row != input.row || item.entry != input.entry) continue;
    Cell cell;
    const std::uint64_t done = state.bytes_done;
    const bool complete = std::exchange(state.complete, false);  // an input that cannot be read is then no failure
    const InputReport report = state.readHere(item, cell);
    state.complete = complete;
    state.bytes_done = done;
    return internal::isUnreadable(report) ? std::optional(refusalReason(report)) : std::nullopt;
  }
  return input.reason;  // unreadable at listing, here too
}

std::vector<std::uint8_t> Input::encodeReports() const {
  internal::ByteWriter out;
  out.u64(state_->units.sizes().size());
  for (const UnitCheck::Sizes& cell : state_->units.sizes()) {
    out.f32(cell.extent_um);
    out.f32(cell.step_um);
  }
  for (std::size_t i = state_->begin_at; i < state_->end(); ++i) {
    const State::Item& item = state_->items[i];
    const SourceReport& row = state_->rows[item.row];
    const bool whole = item.entry == internal::kNoEntry;
    out.u32(item.row);
    out.u32(item.entry);
    out.u64(whole ? row.digest : row.entries[item.entry].digest);
    internal::encodeReport(whole ? row.report : row.entries[item.entry].report, out);
  }
  return out.take();
}

void Input::takeReports(std::span<const std::uint8_t> bytes) {
  internal::ByteReader in(bytes);
  for (std::uint64_t cells = in.u64(); cells > 0; --cells) {
    const float extent_um = in.f32();
    state_->units.add(UnitCheck::Sizes{extent_um, in.f32()});
  }
  while (in.left() > 0) {
    State::Item item;
    item.row = in.u32();
    item.entry = in.u32();
    const std::uint64_t digest = in.u64();
    state_->record(item, digest, internal::decodeReport(in));
  }
  state_->sumContainers();
}

}  // namespace filiform
