#include "index/stores/set_tidy.h"

#include "index/errors.h"
#include "index/file/internal/set_files.h"
#include "index/remote/internal/http_client.h"
#include "index/remote/internal/http_errors.h"
#include "index/remote/internal/s3_listing.h"
#include "index/set/internal/manifest.h"
#include "index/stores/internal/stored_set.h"
#include "index/text.h"
#include "index/workers.h"

#include <algorithm>
#include <atomic>
#include <ctime>
#include <map>
#include <set>
#include <utility>

namespace filiform {
namespace {

using internal::HttpClient;
using internal::RemoteAddress;
using internal::S3Object;
using Kept = StoredRevision::Kept;

constexpr double kDay_s = 86'400;
constexpr std::size_t kRemovedAtOnce = 8;

struct FoundRevision {
  StoredRevision told;
  std::vector<S3Object> objects;  // without the mark
  bool is_marked = false;
};
using FoundRevisions = std::map<std::string, FoundRevision>;

// The other revisions whose files a revision uses.
std::set<std::string> usedBy(HttpClient& client, const RemoteAddress& address, const std::string& revision) {
  const std::string url = address.files + revision + "/" + internal::kManifestFile;
  const internal::Bytes bytes = client.readWhole(url, internal::kMostManifestBytes);
  const std::string text(bytes.begin(), bytes.end());
  if (internal::revisionName(text) != revision)
    throw CorruptSet(url, 0, "its digest differs from the revision's name; nothing was removed");
  std::set<std::string> used;
  try {
    for (const SetFile& file : internal::decodeManifest(text).files)
      if (!file.revision.empty()) used.insert(file.revision);
  } catch (const internal::Damage& damage) {
    throw CorruptSet(url, damage.offset, damage.what + "; nothing was removed");
  }
  return used;
}

FoundRevisions findRevisions(HttpClient& client, const RemoteAddress& address, double oldest_s) {
  FoundRevisions found;
  const auto now = static_cast<double>(std::time(nullptr));
  const auto add = [&](S3Object&& object) {
    const std::size_t slash = object.name.find('/');
    const std::string revision = object.name.substr(0, slash);
    if (slash == std::string::npos || !internal::isRevisionName(revision)) return;
    const auto [at, is_new] = found.try_emplace(revision);
    FoundRevision& one = at->second;
    one.told.name = revision;
    if (is_new) one.told.age_s = now;
    if (object.name.substr(slash + 1) == internal::kRemovalMark) {
      one.is_marked = true;
      return;
    }
    const double age_s = object.written_s == 0 ? 0 : now - static_cast<double>(object.written_s);
    one.told.age_s = std::clamp(age_s, 0.0, one.told.age_s);
    ++(object.upload.empty() ? one.told.objects : one.told.uploads);
    one.told.bytes += object.bytes;
    one.objects.push_back(std::move(object));
  };
  // Uploads first: one that ends meanwhile is then seen as an object.
  for (S3Object& upload : internal::listUploads(client, address, "r-")) add(std::move(upload));
  for (S3Object& object : internal::listObjects(client, address, "r-")) add(std::move(object));
  // What CURRENT names after the lists were read has been there before, or is young.
  const std::string current = internal::currentAt(client, address);
  if (current.empty())
    throw InputError(inShort(address.set) +
                     ": has no CURRENT, so no set is there, or its first push runs; nothing was removed");
  for (auto& [name, one] : found)
    one.told.kept = name == current ? Kept::current : one.told.age_s < oldest_s ? Kept::young : Kept::no;
  std::set<std::string> used = usedBy(client, address, current);
  for (const auto& [name, one] : found) {
    if (one.told.kept != Kept::young) continue;
    try {
      used.merge(usedBy(client, address, name));
    } catch (const internal::NotOnServer&) {  // left by an upload that failed
    }
  }
  for (const std::string& name : used)
    if (const auto at = found.find(name); at != found.end() && at->second.told.kept == Kept::no)
      at->second.told.kept = Kept::used;
  return found;
}

// Sends what changes the store.
void change(HttpClient& client, const RemoteAddress& address, const char* method, const std::string& url) {
  try {
    client.send({.method = method, .url = url});
  } catch (const internal::NotOnServer&) {  // removed meanwhile
  } catch (const internal::DeniedByServer&) {
    throw IoError(inShort(address.set),
                  "these keys may not write and delete here; use keys with s3:PutObject, s3:DeleteObject and "
                  "s3:AbortMultipartUpload, and run tidy again");
  }
}

std::uint64_t removeFound(HttpClient& client, const RemoteAddress& address, const FoundRevisions& found,
                          const TidyOptions& options) {
  const auto markOf = [&](const std::string& revision) {
    return address.files + revision + "/" + internal::kRemovalMark;
  };
  std::vector<std::string> urls, marks;
  for (const auto& [name, one] : found) {
    if (one.is_marked) marks.push_back(markOf(name));
    if (one.is_marked && one.told.kept == Kept::no)
      for (const S3Object& object : one.objects) urls.push_back(object.url);
  }
  std::atomic<std::size_t> next{0};
  runWorkers(std::min(kRemovedAtOnce, urls.size()), [&](std::size_t worker, const std::atomic<bool>& failed) {
    for (std::size_t i = next++; i < urls.size() && !failed; i = next++) {
      if (worker == 0 && options.progress) options.progress(i, urls.size());
      change(client, address, "DELETE", urls[i]);
    }
  });
  for (const std::string& mark : marks) change(client, address, "DELETE", mark);
  return urls.size();
}

}  // namespace

TidyResult tidySet(const std::string& text, const TidyOptions& options) {
  if (!internal::isS3Address(text))
    throw UsageError(inShort(text) +
                     ": only sets in an object store keep old revisions; give s3://BUCKET/PATH/NAME.fil. In a folder, "
                     "ingest removes them");
  if (!(options.older_than_days >= 1 && options.older_than_days <= 36'500))
    throw UsageError("the age of revisions to remove must be 1 to 36500 days");
  const RemoteAddress address(text);
  HttpClient client(address.origin, options.remote, address.account);
  const double oldest_s = options.older_than_days * kDay_s;
  FoundRevisions found = findRevisions(client, address, oldest_s);
  TidyResult result;
  const bool changes = std::any_of(found.begin(), found.end(), [](const auto& one) {
    return one.second.told.kept == Kept::no || one.second.is_marked;
  });
  if (options.remove && changes) {
    for (const auto& [name, one] : found)
      if (one.told.kept == Kept::no && !one.is_marked)
        change(client, address, "PUT", address.files + name + "/" + internal::kRemovalMark);
    found = findRevisions(client, address, oldest_s);
    result.removed = removeFound(client, address, found, options);
  }
  for (auto& [name, one] : found) result.revisions.push_back(std::move(one.told));
  result.counters = client.counters();
  return result;
}

}  // namespace filiform
