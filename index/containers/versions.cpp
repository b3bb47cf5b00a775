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

// Path of the SWC file that would hold the same cell as this ASC file.
std::string twinOf(std::string_view asc_path) {
  std::string twin = lowerCase(asc_path.substr(0, asc_path.size() - 4)) + ".swc";
  const std::size_t slash = twin.rfind('/');
  if (slash == std::string::npos || slash < 3) return twin;
  const bool folder_asc = twin.compare(slash - 3, 3, "asc") == 0 && (slash == 3 || twin[slash - 4] == '/');
  if (folder_asc) twin.replace(slash - 3, 3, "swc");
  return twin;
}

void leaveOutTwins(const std::vector<std::string_view>& paths, std::vector<bool>& left_out) {
  const auto is_asc = [](std::string_view path) { return endsWithNoCase(path, ".asc"); };
  if (std::none_of(paths.begin(), paths.end(), is_asc)) return;
  std::unordered_set<std::string> kept;
  for (std::size_t i = 0; i < paths.size(); ++i)
    if (!left_out[i] && !is_asc(paths[i])) kept.insert(lowerCase(paths[i]));
  for (std::size_t i = 0; i < paths.size(); ++i)
    if (!left_out[i] && is_asc(paths[i])) left_out[i] = kept.contains(twinOf(paths[i]));
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
