#include "index/formats/neuroglancer/object_ids.h"

#include "index/errors.h"
#include "index/text.h"

#include <algorithm>
#include <charconv>
#include <system_error>

namespace filiform {

bool readObjectId(std::string_view text, std::uint64_t& id) {
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  return !text.empty() && error == std::errc() && stop == text.data() + text.size();
}

std::vector<std::uint64_t> readObjectIds(std::string_view text, const std::string& file) {
  std::vector<std::uint64_t> ids;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  for (std::uint64_t line = 1; !text.empty(); ++line) {
    const std::size_t end = text.find('\n');
    std::string_view word = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    word = word.substr(0, word.find('#'));
    constexpr std::string_view kBlanks = " \t\r";
    word.remove_prefix(std::min(word.find_first_not_of(kBlanks), word.size()));
    word = word.substr(0, word.find_last_not_of(kBlanks) + 1);
    if (word.empty()) continue;
    ids.emplace_back();
    if (!readObjectId(word, ids.back()))
      throw InputError(inShort(file) + ":" + std::to_string(line) + ": " + escaped(word, 40) +
                       " is not an id: give one a line, decimal digits from 0 to 2^64-1");
  }
  if (ids.empty()) throw InputError(inShort(file) + ": holds no id");
  return ids;
}

}  // namespace filiform
