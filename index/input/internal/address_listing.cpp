// Lists precomputed skeletons on a web server (file_listing.h). A server lists no folder, so ids or shard numbers tell
// what to ask for.
#include "index/errors.h"
#include "index/input/internal/chosen_objects.h"
#include "index/input/internal/file_listing.h"
#include "index/remote/internal/http_errors.h"
#include "index/remote/internal/remote_address.h"
#include "index/remote/internal/url_origin.h"
#include "index/text.h"
#include "index/workers.h"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace filiform::internal {
namespace {

constexpr std::string_view kSchemes = "gs://, s3://, http:// or https://";
constexpr std::uint64_t kMostShardsAsked = 65536;

std::string shownOf(const std::string& address) {
  const std::size_t slash = address.rfind('/');
  return slash + 1 < address.size() ? address.substr(slash + 1) : address;
}

bool takePrefix(std::string& text, std::string_view prefix) {
  if (lowerCase(text.substr(0, prefix.size())) != prefix) return false;
  text.erase(0, prefix.size());
  return true;
}

// As the programs of Google find it.
std::string endpointOfGoogle() {
  const char* const set = std::getenv("STORAGE_EMULATOR_HOST");
  std::string endpoint = set != nullptr && *set != '\0' ? set : "https://storage.googleapis.com";
  while (endpoint.ends_with('/')) endpoint.pop_back();
  return endpoint.find("://") == std::string::npos ? "http://" + endpoint : endpoint;
}

std::string infoAt(const SkeletonFiles& files) {
  try {
    return files.readText("info", SkeletonInfo::kMaxBytes);
  } catch (const NotOnServer&) {
    throw IoError(inShort(files.pathOf("info")),
                  "is not on the server (404); give the address of a folder of skeletons, or of a volume whose info "
                  "names one");
  }
}

// The shards that may hold an object, and exist. Adds to `missing` the others, with the reason.
std::vector<std::string> shardsAt(const SkeletonFiles& files, const SkeletonInfo& info, const ListingOptions& options,
                                  const std::string& address, std::map<std::string, std::string>& missing) {
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
  const std::vector<std::uint64_t> asked(numbers.begin(), numbers.end());
  std::vector<std::exception_ptr> absent(asked.size());  // why a shard is not there; without objects it has no file
  runItems(asked.size(), requestsAtOnce(options.remote.connections), [&](std::size_t i) {
    try {
      files.size(info.sharding->fileNameOf(asked[i]));
    } catch (const NotOnServer&) {
      absent[i] = std::current_exception();
    } catch (const DeniedByServer&) {  // also the answer of some object stores for a file that is not there
      absent[i] = std::current_exception();
    }
  });
  std::vector<std::string> names;
  std::exception_ptr denied;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const std::string name = info.sharding->fileNameOf(asked[i]);
    try {
      if (absent[i]) std::rethrow_exception(absent[i]);
      names.push_back(name);
    } catch (const NotOnServer&) {
      missing[name] = "is not on the server (404)";
    } catch (const DeniedByServer&) {
      missing[name] = "is refused by the server (403), or is not there";
      denied = absent[i];
    }
  }
  if (names.empty() && denied) std::rethrow_exception(denied);
  return names;
}

}  // namespace

std::string skeletonAddress(const std::string& argument) {
  std::string address = argument;
  const bool named = takePrefix(address, "precomputed://");
  takePrefix(address, "middleauth+");  // of CAVE: the token of --token-file
  const std::size_t bar = address.find('|');
  const std::string reader = bar == std::string::npos ? std::string() : address.substr(bar + 1);
  address.resize(std::min(bar, address.size()));
  const bool google = takePrefix(address, "gs://"), s3 = isS3Address(address);
  while (address.ends_with('/')) address.pop_back();
  if (google) {
    if (address.empty()) throw UsageError(inShort(argument) + ": is not a valid address; give gs://BUCKET/PATH");
    address = endpointOfGoogle() + "/" + address;
  } else if (!s3 && originOf(address).empty()) {
    if (named) throw UsageError(inShort(argument) + ": is not a valid address; give " + std::string(kSchemes));
    return {};
  }
  if (!s3 && originOf(address).empty())
    throw UsageError(inShort(argument) + ": is not a valid address; check the bucket and STORAGE_EMULATOR_HOST");
  if (bar != std::string::npos && reader != "neuroglancer-precomputed:")
    throw InputError(inShort(argument) + ": of what follows '|', only neuroglancer-precomputed: is known");
  return address;
}

std::vector<ListedFile> listAddress(const std::string& given, const ListingOptions& options) {
  std::string address = given;
  auto source = filesAtAddress(address, options.remote);
  std::string text = infoAt(*source);
  std::optional<SkeletonVolume> through;
  if (!SkeletonInfo::isSkeletonInfo(text)) {
    const SkeletonInfo::Elsewhere there = SkeletonInfo::elsewhere(text, source->pathOf("info"));
    if (!there.folder.empty()) {
      through = {source, text, there.segment_properties};
      address += "/" + there.folder;
      source = filesAtAddress(address, options.remote);
      text = infoAt(*source);
    }
    if (there.folder.empty() || !SkeletonInfo::isSkeletonInfo(text))
      throw InputError(inShort(address) + ": its info is " +
                       (there.what.empty() ? "not that of skeletons" : "that of " + there.what) +
                       "; give the address of a folder of skeletons, or of a volume whose info names one");
  }
  const auto info = std::make_shared<const SkeletonInfo>(SkeletonInfo::parse(text, source->pathOf("info")));
  const auto properties = readProperties(*source, *info, through ? &*through : nullptr);
  const auto volume = [&] {
    if (through) return *through;
    const auto above = filesAtAddress(address.substr(0, address.rfind('/')), options.remote);
    return SkeletonVolume{above, above->findText("info", SkeletonInfo::kMaxBytes).value_or(""), {}};
  };
  ListingOptions wanted = options;
  wanted.ids = chosenObjects(*source, text, properties.get(), volume, options);
  if (!wanted.ids && properties && !properties->ids().empty())
    wanted.ids = std::make_shared<const std::vector<std::uint64_t>>(properties->ids());
  std::vector<ListedFile> files;
  if (info->sharding) {
    std::map<std::string, std::string> missing;
    for (const std::string& name : shardsAt(*source, *info, wanted, address, missing)) {
      ListedFile file{source->pathOf(name), name};
      file.kind = FileKind::shard;
      files.push_back(std::move(file));
    }
    if (files.empty()) throw InputError(inShort(address) + ": holds no shard" + (wanted.ids ? " with these ids" : ""));
    if (wanted.ids)
      for (const std::uint64_t id : *wanted.ids)
        if (const auto shard = missing.find(info->sharding->fileNameOf(info->sharding->shardOf(id)));
            shard != missing.end())
          files.push_back(missingObject(*source, id, "its shard " + shard->first + " " + shard->second));
  } else {
    if (!wanted.ids)
      throw InputError(
          inShort(address) +
          ": a server does not list its skeletons; name them with --ids FILE, one id a line, or choose with --box");
    ListedFile file{address, shownOf(address)};
    file.kind = FileKind::objects;
    files.push_back(std::move(file));
  }
  for (ListedFile& file : files) {
    file.skeleton = info;
    file.properties = properties;
    file.skeleton_files = source;
    file.ids = wanted.ids;
  }
  return files;
}

}  // namespace filiform::internal
