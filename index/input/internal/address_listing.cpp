// Lists precomputed skeletons on a web server (file_listing.h). A server lists no folder, so ids or shard numbers tell
// what to ask for.
#include "index/errors.h"
#include "index/input/internal/file_listing.h"
#include "index/remote/internal/http_errors.h"
#include "index/remote/internal/url_origin.h"
#include "index/text.h"

#include <algorithm>
#include <set>
#include <string>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::string_view kPrecomputed = "precomputed://";
constexpr std::uint64_t kMostProperties = std::uint64_t{1} << 28;  // bytes
constexpr std::uint64_t kMostShardsAsked = 65536;

std::shared_ptr<const std::vector<std::uint64_t>> ascending(std::vector<std::uint64_t> ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return std::make_shared<const std::vector<std::uint64_t>>(std::move(ids));
}

std::string shownOf(const std::string& address) {
  const std::size_t slash = address.rfind('/');
  return slash + 1 < address.size() ? address.substr(slash + 1) : address;
}

// The shards that may hold an object, and exist.
std::vector<std::string> shardsAt(const SkeletonFiles& files, const SkeletonInfo& info, const ListingOptions& options,
                                  const std::string& address) {
  std::set<std::uint64_t> numbers;
  if (options.ids) {
    for (const std::uint64_t id : *options.ids) numbers.insert(info.sharding->shardOf(id));
  } else {
    const std::uint64_t all = info.sharding->shards().value_or(UINT64_MAX);
    if (all > kMostShardsAsked)
      throw InputError(inShort(address) + ": may have 2^" + std::to_string(info.sharding->shard_bits) +
                       " shards, and a server does not list them; name the objects with --ids FILE");
    for (std::uint64_t shard = 0; shard < all; ++shard) numbers.insert(shard);
  }
  std::vector<std::string> names;
  for (const std::uint64_t number : numbers) {
    std::string name = info.sharding->fileNameOf(number);
    try {
      files.size(name);
      names.push_back(std::move(name));
    } catch (const NotOnServer&) {  // a shard without objects has no file
    }
  }
  return names;
}

}  // namespace

std::string skeletonAddress(const std::string& argument) {
  std::string address = argument.starts_with(kPrecomputed) ? argument.substr(kPrecomputed.size()) : argument;
  if (originOf(address).empty()) return {};
  while (address.ends_with('/')) address.pop_back();
  return address;
}

std::vector<ListedFile> listAddress(const std::string& address, const ListingOptions& options) {
  const auto source = filesAtAddress(address, options.remote);
  const std::string text = source->readWhole("info", SkeletonInfo::kMaxBytes);
  if (!SkeletonInfo::isSkeletonInfo(text))
    throw InputError(inShort(address) + ": its info is not that of skeletons; give the address of their folder");
  const auto info = std::make_shared<const SkeletonInfo>(SkeletonInfo::parse(text, source->pathOf("info")));
  ListingOptions wanted = options;
  if (!wanted.ids && !info->segment_properties.empty()) {
    const std::string file = info->segment_properties + "/info";
    try {
      wanted.ids = ascending(readSegmentProperties(source->readWhole(file, kMostProperties), source->pathOf(file)));
    } catch (const NotOnServer&) {
      if (!info->sharding) throw;
    }
  }
  std::vector<ListedFile> files;
  if (info->sharding) {
    for (const std::string& name : shardsAt(*source, *info, wanted, address)) {
      ListedFile file{source->pathOf(name), name};
      file.kind = FileKind::shard;
      files.push_back(std::move(file));
    }
    if (files.empty()) throw InputError(inShort(address) + ": holds no shard" + (wanted.ids ? " with these ids" : ""));
  } else {
    if (!wanted.ids)
      throw InputError(inShort(address) +
                       ": a server does not list its skeletons; name them with --ids FILE, one id a line");
    ListedFile file{address, shownOf(address)};
    file.kind = FileKind::objects;
    files.push_back(std::move(file));
  }
  for (ListedFile& file : files) {
    file.skeleton = info;
    file.skeleton_files = source;
    file.ids = wanted.ids;
  }
  return files;
}

}  // namespace filiform::internal
