// Finds and removes what older pushes left of a set in an object store.
//
// A revision stays if CURRENT names it, if a revision that stays uses its files, or if something of it is younger than
// the stated age: an object, or an upload in parts that has not ended. A push that runs has sent its manifest again, so
// its revision is young, also if all its files were there before. To remove a revision, tidySet() first puts a mark
// into it, then looks again. pushSet() refuses a revision with a mark. So neither overlooks the other. Only objects
// below the folders of revisions are removed. Only one call at a time for a set: a second one would take the marks
// away.
#pragma once

#include "index/remote/remote_options.h"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace filiform {

struct TidyOptions {
  RemoteOptions remote{};
  double older_than_days = 7;  // at least 1, so that no push is as old
  bool remove = false;
  // Called on the calling thread before each object is removed, with their number. Exceptions propagate.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress{};
};

struct StoredRevision {
  enum class Kept : std::uint8_t { no, current, used, young };
  std::string name{};
  std::uint64_t objects = 0, bytes = 0;  // that are there
  std::uint64_t uploads = 0;             // in parts, that have not ended; the store does not tell their bytes
  double age_s = 0;                      // of the youngest object or upload
  Kept kept = Kept::no;                  // used: by a revision that stays
};

struct TidyResult {
  std::vector<StoredRevision> revisions{};  // by name, as they were found
  std::uint64_t removed = 0;                // objects and uploads
  RemoteCounters counters{};
};

// Lists the revisions of the set at `s3://BUCKET/PATH/NAME.fil`, and removes those that do not stay if `remove` is set.
// After a failure or an interruption, the next call goes on. Throws UsageError if `address` is not s3:// or the age is
// out of range; InputError if CURRENT is missing; CorruptSet if the manifest of a revision that stays is damaged;
// IoError, also if the keys may not list, write or delete. A request for each 1000 objects, and one for each object
// that is removed.
TidyResult tidySet(const std::string& address, const TidyOptions& options = {});

}  // namespace filiform
