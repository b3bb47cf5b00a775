#include "index/count_text.h"

namespace filiform {

std::string formatCount(std::uint64_t count) {
  std::string text = std::to_string(count);
  for (std::size_t i = text.size(); i > 3; i -= 3) text.insert(i - 3, 1, ' ');
  return text;
}

std::string counted(std::uint64_t count, std::string_view one, std::string_view many) {
  std::string text = formatCount(count) + ' ';
  text += count == 1 || many.empty() ? one : many;
  return count == 1 || !many.empty() ? text : text + 's';
}

}  // namespace filiform
