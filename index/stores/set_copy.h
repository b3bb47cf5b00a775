// Copies a tile set to an object store, and from any address to a folder.
//
// The files of a revision never change, so both calls leave out what is there already: an interrupted copy goes on
// where it stopped, and a set that has grown (growth.h) takes its new files only. CURRENT is written last. Until then
// readers find the revision that it named before.
#pragma once

#include "index/remote/remote_options.h"

#include <cstdint>
#include <functional>
#include <string>

namespace filiform {

struct CopyOptions {
  RemoteOptions remote{};
  bool force = false;  // pullSet: replace another set in the folder
  // Called on the calling thread with bytes that are there, of all. Exceptions propagate.
  std::function<void(std::uint64_t done, std::uint64_t total)> progress{};
};

struct CopyResult {
  std::string revision{}, before{};            // before: that CURRENT named; empty: none
  std::uint64_t files = 0, bytes = 0;          // of the revision
  std::uint64_t copied = 0, copied_bytes = 0;  // of them; the others were there
  RemoteCounters counters{};
};

// Copies the set in a folder to `s3://BUCKET/PATH/NAME.fil`. Files of 16 MiB and more are sent in parts of 8 MiB, eight
// at once. The parts of an interrupted copy that the store still has are used. Older revisions stay at the address
// until tidySet() removes them. Each file is checked before it is sent. Throws UsageError if `address` is not s3://,
// CorruptSet if the set is damaged, InputError if tidySet() is removing the revision, IoError.
CopyResult pushSet(const std::string& folder, const std::string& address, const CopyOptions& options = {});

// Copies the set at an address to a folder, and checks each file. After a failure the finished files stay there for the
// next call. Older revisions are removed, as ingest() does. Throws InputError if the folder holds another set and
// `force` is not set, or is no tile set; IoError, CorruptSet.
CopyResult pullSet(const std::string& address, const std::string& folder, const CopyOptions& options = {});

}  // namespace filiform
