#include "index/containers/internal/container.h"

#include "index/text.h"

#include <algorithm>
#include <unordered_set>

namespace filiform {

void Container::refuse(InputCode code, std::string_view token) {
  refusal_ = code;
  refusal_token_ = escaped(token, 300);
  entries_.clear();
}

void Container::finishListing() {
  std::unordered_set<std::string_view> labels;
  for (ArchiveEntry& entry : entries_) {
    if (!entry.skipped && !labels.insert(entry.shown_label()).second)
      entry.remarks.push_back(InputCode::W_ZIP_DUP_NAME);
  }
  refuseWithoutInput();
}

void Container::refuseWithoutInput() {
  if (std::all_of(entries_.begin(), entries_.end(), [](const ArchiveEntry& entry) { return entry.skipped; }))
    refusal_ = InputCode::E_ZIP_NO_SWC;
}

void Container::leaveOut(MorphologyVersion versions) {
  std::vector<std::string_view> names;
  std::vector<ArchiveEntry*> open;
  for (ArchiveEntry& entry : entries_) {
    if (entry.skipped) continue;
    names.push_back(entry.shown_label());
    open.push_back(&entry);
  }
  const std::vector<bool> left_out = versionsLeftOut(names, versions);
  for (std::size_t i = 0; i < open.size(); ++i) {
    if (!left_out[i]) continue;
    open[i]->skipped = true;
    open[i]->remarks = {InputCode::OTHER_VERSION};
  }
}

}  // namespace filiform
