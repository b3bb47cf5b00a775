// SetFolder: the folder of a tile set while a revision is made. It is locked, and restored unless publish() succeeds.
#pragma once

#include "index/internal/descriptor.h"

#include <cstdint>
#include <string>
#include <vector>

namespace filiform::internal {

// The name of a set that is made inside the folder `set` and removed before it is unlocked: of this process.
std::string asideOf(const std::string& set);

// Thread rule: thread-compatible; only one process at a time has the lock.
class SetFolder {
 public:
  enum class Purpose : std::uint8_t {
    create,   // there must be no set
    replace,  // a set may be there
    grow,     // a set must be there
  };
  // Creates or locks the folder, and creates a folder in it for the new revision. Throws InputError if the folder is
  // not a tile set, is one although `purpose` forbids it, lies inside another set (except asideOf()), has the name of
  // an input, or another process writes it. Throws IoError.
  SetFolder(const std::string& path, Purpose purpose);
  SetFolder(const SetFolder&) = delete;
  SetFolder& operator=(const SetFolder&) = delete;
  ~SetFolder() { undo(); }

  const std::string& building() const { return building_; }  // the folder of the new revision

  // Makes the new revision the current one, and removes others except those of `in_use`. Returns false if the same
  // revision is already published and complete. Throws IoError.
  bool publish(const std::string& revision, const std::vector<std::string>& in_use = {});
  // The same for a revision whose folder is complete and on disk already.
  void publishPresent(const std::string& revision, const std::vector<std::string>& in_use);
  // From now on, a failure leaves the folder and what lies in it, except building().
  void keepAfterFailure() { created_ = false; }
  const std::string& previous() const { return previous_; }  // revision of the set that was there; empty: none

 private:
  void lock();
  void inspect(Purpose purpose);
  void writeCurrent(const std::string& revision);
  void removeOthers(const std::string& revision, const std::vector<std::string>& in_use) noexcept;
  void undo() noexcept;
  void removeMade() const;

  std::string path_, previous_;
  std::string building_, target_, aside_, next_;  // to be undone; empty: none
  bool created_ = false;
  Descriptor folder_;  // locked
};

}  // namespace filiform::internal
