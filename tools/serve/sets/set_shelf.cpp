#include "tools/serve/sets/set_shelf.h"

#include "index/errors.h"
#include "index/remote/http_source.h"
#include "index/text.h"
#include "index/workers.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <set>
#include <string_view>
#include <utility>

namespace filiform::tools {

namespace {

constexpr std::chrono::seconds kLately{60};  // a set that was asked for keeps its part of the budget for so long
constexpr std::chrono::seconds kFarLook{10};
constexpr std::size_t kOpenedAtOnce = 8;  // sets that are opened

std::string servedName(const std::string& path) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::path(path).lexically_normal();
  std::string name = (folder.has_filename() ? folder : folder.parent_path()).filename().string();
  std::error_code missing;
  if (name == "." || name == "..") name = fs::canonical(folder, missing).filename().string();
  if (endsWithNoCase(name, ".fil")) name.resize(name.size() - 4);
  return name;
}

bool isPlainName(std::string_view name) {
  return !name.empty() && name.front() != '.' && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_' ||
           c == '.';
  });
}

// Throws UsageError if two have the same name.
void checkNames(const std::vector<ShelfEntry>& entries) {
  std::set<std::string> names;
  for (const ShelfEntry& entry : entries)
    if (!names.insert(entry.name).second)
      throw UsageError("SET " + escaped(entry.path, 80) + ": another set has the name '" + escaped(entry.name, 80) +
                       "'; give this one another name: NAME=" + escaped(entry.path, 80));
}

// What is left of the budget, for each of the entries without one of their own.
std::uint64_t partOf(std::uint64_t budget_bytes, const std::vector<ShelfEntry>& entries) {
  std::uint64_t sharing = 0;
  for (const ShelfEntry& entry : entries) {
    budget_bytes -= std::min(budget_bytes, entry.budget_bytes);
    sharing += entry.budget_bytes == 0;
  }
  return budget_bytes / std::max<std::uint64_t>(sharing, 1);
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

std::vector<ShelfEntry> shelfEntries(const std::vector<std::string>& texts, const RemoteOptions& remote) {
  std::vector<ShelfEntry> entries;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    std::error_code missing;
    const bool named = equals != std::string::npos && isPlainName(std::string_view(text).substr(0, equals)) &&
                       equals + 1 < text.size() && !std::filesystem::exists(text, missing);
    const std::string path = named ? text.substr(equals + 1) : text;
    entries.push_back({named ? text.substr(0, equals) : servedName(path), path, remote});
    if (entries.back().name.empty())
      throw UsageError("SET " + escaped(path, 80) +
                       ": a set needs a folder with a name; or give NAME=" + escaped(path, 80));
  }
  return entries;
}

SetShelf::SetShelf(const std::vector<ShelfEntry>& entries, std::uint64_t budget_bytes)
    : budget_bytes_(budget_bytes), part_bytes_(partOf(budget_bytes, entries)) {
  checkNames(entries);
  for (const ShelfEntry& entry : entries) slots_.push_back({entry});
  const std::exception_ptr failure = openNew(slots_);
  for (const Slot& slot : slots_)
    if (!slot.problem.empty()) problems_.push_back(slot.problem);
  if (!entries.empty() && problems_.size() == entries.size()) std::rethrow_exception(failure);
}

std::exception_ptr SetShelf::openNew(std::vector<Slot>& slots) const {
  std::vector<std::exception_ptr> failures(slots.size());
  runItems(slots.size(), kOpenedAtOnce, [&](std::size_t i) {
    if (slots[i].current != nullptr) return;
    try {
      open(slots[i]);
    } catch (const std::exception& error) {
      failures[i] = std::current_exception();
      slots[i].problem = error.what();
    }
  });
  return failures.empty() ? nullptr : failures.front();
}

void SetShelf::open(Slot& slot) const {
  const ShelfEntry& entry = slot.entry;
  slot.next_look = std::chrono::steady_clock::now() + kFarLook;
  if (slot.watched == nullptr && isAddress(entry.path)) slot.watched = openSource(entry.path, entry.remote);
  auto opened = std::make_shared<const ServedSet>(entry.name, entry.path,
                                                  entry.budget_bytes != 0 ? entry.budget_bytes : part_bytes_,
                                                  entry.remote, entry.open_files);
  const std::lock_guard lock(mutex_);
  if (slot.current != nullptr) {
    slot.older.insert(slot.older.begin(), slot.current->sharedSet());
    slot.older.resize(std::min(slot.older.size(), kOlder));
  }
  slot.current.swap(opened);
  slot.stale.reset();
  slot.budget_bytes = part_bytes_;
}

void SetShelf::replace(const std::vector<ShelfEntry>& entries) {
  checkNames(entries);
  part_bytes_ = partOf(budget_bytes_, entries);
  std::vector<Slot> slots;
  {
    const std::lock_guard lock(mutex_);  // of what find() notes
    for (const ShelfEntry& entry : entries) {
      const Slot* const known = slot(entry.name);
      slots.push_back(known != nullptr && known->current != nullptr && known->entry == entry ? *known : Slot{entry});
      slots.back().entry.readers = entry.readers;
    }
  }
  openNew(slots);
  for (Slot& fresh : slots) {
    const Slot* const known = slot(fresh.entry.name);
    if (known == nullptr || known->current == nullptr || fresh.current != nullptr) continue;
    fresh.current = known->current;
    fresh.older = known->older;
    fresh.stale = known->stale.value_or(known->entry.readers);
  }
  {
    const std::lock_guard lock(mutex_);
    for (Slot& fresh : slots)
      if (const Slot* const known = slot(fresh.entry.name); known != nullptr) {
        fresh.requests = known->requests;
        fresh.asked = known->asked;
      }
    slots_.swap(slots);
  }
  refresh();
}

std::vector<SetShelf::State> SetShelf::states(const Person* who) const {
  const std::lock_guard lock(mutex_);
  std::vector<State> states;
  for (const Slot& slot : slots_) {
    if (!sees(who, slot)) continue;
    states.push_back(
        {slot.entry.name, slot.current != nullptr, slot.current != nullptr && slot.problem.empty(), slot.requests});
  }
  return states;
}

bool SetShelf::sees(const Person* who, const Slot& slot) {
  return who == nullptr ||
         (who->sees(slot.entry.name, slot.entry.readers) && (!slot.stale || who->sees(slot.entry.name, *slot.stale)));
}

std::vector<std::shared_ptr<const ServedSet>> SetShelf::all(const Person* who) const {
  const std::lock_guard lock(mutex_);
  std::vector<std::shared_ptr<const ServedSet>> sets;
  for (const Slot& slot : slots_)
    if (slot.current != nullptr && sees(who, slot)) sets.push_back(slot.current);
  return sets;
}

const SetShelf::Slot* SetShelf::slot(const std::string& name) const {
  const auto found =
      std::find_if(slots_.begin(), slots_.end(), [&](const Slot& one) { return one.entry.name == name; });
  return found == slots_.end() ? nullptr : &*found;
}

std::shared_ptr<const ServedSet> SetShelf::find(const std::string& name, const Person* who) const {
  const std::lock_guard lock(mutex_);
  const Slot* const found = slot(name);
  if (found == nullptr || !sees(who, *found)) return nullptr;
  ++found->requests;
  found->asked = std::chrono::steady_clock::now();
  return found->current;
}

bool SetShelf::isCurrent(const ServedSet& served) const {
  const std::lock_guard lock(mutex_);
  const Slot* const found = slot(served.name());
  return found != nullptr && found->current.get() == &served;
}

bool SetShelf::has(const std::string& name, const Person* who) const {
  const std::lock_guard lock(mutex_);
  const Slot* const found = slot(name);
  return found != nullptr && sees(who, *found);
}

std::shared_ptr<const TileSet> SetShelf::revision(const std::string& name, const std::string& revision) const {
  const std::lock_guard lock(mutex_);
  const Slot* const found = slot(name);
  if (found == nullptr || found->current == nullptr) return nullptr;
  if (found->current->set().revision() == revision) return found->current->sharedSet();
  for (const auto& set : found->older)
    if (set->revision() == revision) return set;
  return nullptr;
}

void SetShelf::shareBudget() {
  std::vector<std::pair<std::shared_ptr<const ServedSet>, std::uint64_t>> changed;
  std::unique_lock lock(mutex_);
  std::uint64_t free_bytes = budget_bytes_;
  std::vector<Slot*> asked, others;
  const auto now = std::chrono::steady_clock::now();
  for (Slot& slot : slots_) {
    free_bytes -= std::min(free_bytes, slot.entry.budget_bytes);
    if (slot.entry.budget_bytes != 0 || slot.current == nullptr) continue;
    const bool lately = slot.asked != std::chrono::steady_clock::time_point{} && now - slot.asked < kLately;
    (lately ? asked : others).push_back(&slot);
  }
  const std::uint64_t rest = others.empty() ? 0 : asked.empty() ? free_bytes : free_bytes / 8;
  for (const auto& [slots, bytes] : {std::pair(&asked, free_bytes - rest), std::pair(&others, rest)})
    for (Slot* const slot : *slots) {
      const std::uint64_t part = bytes / slots->size();
      if (slot->budget_bytes != part) changed.emplace_back(slot->current, part);
      slot->budget_bytes = part;
    }
  lock.unlock();
  for (const auto& [set, part] : changed) set->setBudget(part);
}

std::vector<std::string> SetShelf::refresh() {
  std::vector<std::string> problems;
  runItems(slots_.size(), kOpenedAtOnce, [&](std::size_t i) {
    Slot& slot = slots_[i];  // only this call changes slots
    const auto now = std::chrono::steady_clock::now();
    const bool rarely = slot.watched != nullptr || slot.current == nullptr || slot.stale;
    std::string problem = slot.problem;
    if (!rarely || now >= slot.next_look) {
      slot.next_look = now + kFarLook;
      problem.clear();
      try {
        if (slot.current == nullptr || slot.stale ||
            namedRevision(slot.watched != nullptr ? *slot.watched : *openFolder(slot.entry.path, 1)) !=
                slot.current->set().revision())
          open(slot);
      } catch (const std::exception& error) {
        problem = error.what();
      }
    }
    const std::lock_guard lock(mutex_);
    slot.problem = std::move(problem);
  });
  shareBudget();
  const std::lock_guard lock(mutex_);
  for (const Slot& slot : slots_)
    if (!slot.problem.empty()) problems.push_back(slot.problem);
  problems_ = problems;
  return problems;
}

std::vector<std::string> SetShelf::problems() const {
  const std::lock_guard lock(mutex_);
  return problems_;
}

}  // namespace filiform::tools
