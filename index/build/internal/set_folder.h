// SetFolder: the folder of a tile set during one ingest. It is locked, and restored unless publish() succeeds.
#pragma once

#include <string>

namespace filiform::internal {

// Thread rule: thread-compatible; only one process at a time has the lock.
class SetFolder {
 public:
  // Creates or locks the folder, and creates a folder in it for the new revision. Throws InputError if the folder is
  // not a tile set, is one without `force`, or another ingest writes it. Throws IoError.
  SetFolder(const std::string& path, bool force);
  SetFolder(const SetFolder&) = delete;
  SetFolder& operator=(const SetFolder&) = delete;
  ~SetFolder() { undo(); }

  const std::string& building() const { return building_; }  // the folder of the new revision

  // Makes the new revision the current one, and removes others. Returns false if the same revision is already published
  // and complete. Throws IoError.
  bool publish(const std::string& revision);

 private:
  void lock();
  void inspect(bool force);
  void removeOthers(const std::string& revision) noexcept;
  void undo() noexcept;
  void removeMade() const;

  std::string path_, previous_;
  std::string building_, target_, aside_, next_;  // to be undone; empty: none
  bool created_ = false;
  int folder_ = -1;
};

}  // namespace filiform::internal
