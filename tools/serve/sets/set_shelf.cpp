#include "tools/serve/sets/set_shelf.h"

#include "index/errors.h"
#include "index/remote/http_source.h"
#include "index/text.h"

#include <algorithm>
#include <exception>
#include <filesystem>

namespace filiform::tools {

namespace {

constexpr std::chrono::seconds kFarLook{10};

std::string servedName(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(path).lexically_normal();
  std::string name = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  std::error_code missing;
  if (name == "." || name == "..") name = fs::canonical(folder, missing).filename().string();
  if (endsWithNoCase(name, ".fil")) name.resize(name.size() - 4);
  return name;
}

// The revision that CURRENT names now.
std::string namedRevision(const TileSource& source) {
  std::vector<std::uint8_t> bytes(std::min<std::uint64_t>(source.size("CURRENT"), 64));
  source.read("CURRENT", 0, bytes);
  std::string text(bytes.begin(), bytes.end());
  if (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

}  // namespace

SetShelf::SetShelf(const std::vector<std::string>& paths, std::uint64_t budget_bytes, const RemoteOptions& remote)
    : budget_bytes_(budget_bytes / std::max<std::size_t>(paths.size(), 1)), remote_(remote) {
  for (const std::string& path : paths) {
    const std::string name = servedName(path);
    if (name.empty()) throw UsageError("SET " + escaped(path, 80) + ": a set needs a folder with a name");
    if (find(name))
      throw UsageError("SET " + escaped(path, 80) + ": another set has the name '" + escaped(name, 80) +
                       "'; serve it under a link with another name");
    slots_.push_back({path, isAddress(path) ? openSource(path, remote_) : nullptr,
                      std::make_shared<const ServedSet>(name, path, budget_bytes_, remote_)});
  }
}

std::vector<std::shared_ptr<const ServedSet>> SetShelf::all() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<const ServedSet>> sets;
  for (const Slot& slot : slots_) sets.push_back(slot.current);
  return sets;
}

std::shared_ptr<const ServedSet> SetShelf::find(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  for (const Slot& slot : slots_)
    if (slot.current->name() == name) return slot.current;
  return nullptr;
}

std::shared_ptr<const TileSet> SetShelf::revision(const std::string& name, const std::string& revision) const {
  const std::lock_guard lock(mutex_);
  for (const Slot& slot : slots_) {
    if (slot.current->name() != name) continue;
    if (slot.current->set().revision() == revision) return slot.current->sharedSet();
    for (const auto& set : slot.older)
      if (set->revision() == revision) return set;
  }
  return nullptr;
}

std::vector<std::string> SetShelf::refresh() {
  std::vector<std::string> problems;
  for (Slot& slot : slots_) {  // only refresh() changes slots
    const std::shared_ptr<const ServedSet> current = slot.current;
    if (slot.watched != nullptr) {
      const auto now = std::chrono::steady_clock::now();
      if (now < slot.next_look) {
        if (!slot.problem.empty()) problems.push_back(slot.problem);
        continue;
      }
      slot.next_look = now + kFarLook;
      slot.problem.clear();
    }
    try {
      const std::string named = namedRevision(slot.watched != nullptr ? *slot.watched : *openFolder(slot.path, 1));
      if (named == current->set().revision()) continue;
      const auto fresh = std::make_shared<const ServedSet>(current->name(), slot.path, budget_bytes_, remote_);
      const std::lock_guard lock(mutex_);
      slot.older.insert(slot.older.begin(), current->sharedSet());
      slot.older.resize(std::min(slot.older.size(), kOlder));
      slot.current = fresh;
    } catch (const std::exception& error) {
      problems.push_back(error.what());
      slot.problem = error.what();
    }
  }
  const std::lock_guard lock(mutex_);
  problems_ = problems;
  return problems;
}

std::vector<std::string> SetShelf::problems() const {
  const std::lock_guard lock(mutex_);
  return problems_;
}

}  // namespace filiform::tools
