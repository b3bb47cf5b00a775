#include "index/containers/versions.h"

#include "index/text.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <unordered_set>

namespace filiform {
namespace {

struct Version {
  bool cng = false;
  std::array<std::string, 2> keys;  // neuron and folder; neuron and the folder above
};

std::optional<Version> versionOf(std::string_view path) {
  const std::string lower = lowerCase(path);
  std::string_view folder, name = lower;
  if (const std::size_t slash = lower.rfind('/'); slash != std::string::npos) {
    folder = name.substr(0, slash);
    name.remove_prefix(slash + 1);
  }
  Version version;
  version.cng = name.ends_with(".cng.swc");
  if (version.cng) {
    name.remove_suffix(std::string_view(".cng.swc").size());
  } else if (name.ends_with(".swc") || name.ends_with(".asc")) {
    name.remove_suffix(4);
  } else {
    return std::nullopt;
  }
  const std::size_t slash = folder.rfind('/');
  const std::string_view above = slash == std::string_view::npos ? std::string_view() : folder.substr(0, slash);
  version.keys = {std::string(name) + '\0' + std::string(folder), std::string(name) + '\0' + std::string(above)};
  return version;
}

void leaveOutVersions(const std::vector<std::string_view>& paths, bool keep_cng, std::vector<bool>& left_out) {
  std::unordered_set<std::string> kept;
  for (const std::string_view path : paths) {
    const std::optional<Version> version = versionOf(path);
    if (version && version->cng == keep_cng) kept.insert(version->keys.begin(), version->keys.end());
  }
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const std::optional<Version> version = versionOf(paths[i]);
    left_out[i] = version && version->cng != keep_cng &&
                  std::any_of(version->keys.begin(), version->keys.end(),
                              [&](const std::string& key) { return kept.contains(key); });
  }
}

// The path of the file that would hold the same cell in another format: its ending, and its folder if this is named
// like the format.
std::string twinOf(std::string_view path, std::string_view ending) {
  const std::size_t dot = path.rfind('.');
  std::string twin = lowerCase(path.substr(0, dot));
  const std::string own = lowerCase(path.substr(dot + 1));
  const std::size_t slash = twin.rfind('/');
  if (slash != std::string::npos) {
    const std::size_t above = slash == 0 ? std::string::npos : twin.rfind('/', slash - 1);
    const std::size_t begin = above == std::string::npos ? 0 : above + 1;
    const std::string folder = twin.substr(begin, slash - begin);
    if (folder == own || (own == "h5" && folder == "h5v1")) twin.replace(begin, slash - begin, ending);
  }
  return twin + "." + std::string(ending);
}

void leaveOutTwins(const std::vector<std::string_view>& paths, std::vector<bool>& left_out) {
  const auto is = [](std::string_view path, std::string_view ending) { return endsWithNoCase(path, ending); };
  if (std::none_of(paths.begin(), paths.end(),
                   [&](std::string_view path) { return is(path, ".asc") || is(path, ".h5"); }))
    return;
  std::unordered_set<std::string> kept;  // of formats that come first
  for (const std::string_view ending : {".swc", ".asc", ".h5"}) {
    for (std::size_t i = 0; i < paths.size(); ++i) {
      if (left_out[i] || !is(paths[i], ending)) continue;
      if (ending == ".asc") left_out[i] = kept.contains(twinOf(paths[i], "swc"));
      if (ending == ".h5")
        left_out[i] = kept.contains(twinOf(paths[i], "swc")) || kept.contains(twinOf(paths[i], "asc"));
    }
    for (std::size_t i = 0; i < paths.size(); ++i)
      if (!left_out[i] && is(paths[i], ending)) kept.insert(lowerCase(paths[i]));
  }
}

}  // namespace

std::vector<bool> versionsLeftOut(const std::vector<std::string_view>& paths, MorphologyVersion wanted) {
  std::vector<bool> left_out(paths.size(), false);
  const bool any_cng =
      std::any_of(paths.begin(), paths.end(), [](std::string_view path) { return endsWithNoCase(path, ".cng.swc"); });
  if (wanted == MorphologyVersion::both) return left_out;
  if (any_cng) leaveOutVersions(paths, wanted == MorphologyVersion::cng, left_out);
  leaveOutTwins(paths, left_out);
  return left_out;
}

}  // namespace filiform
