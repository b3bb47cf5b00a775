#include "tools/serve/routes/cursor.h"

#include <charconv>

namespace filiform::tools {

std::string cursorText(const Call& call, std::initializer_list<std::uint64_t> place) {
  std::string text = call.served->set().revision();
  for (const std::uint64_t number : place) text += ':' + std::to_string(number);
  return text;
}

std::optional<std::vector<std::uint64_t>> cursorOf(const Call& call, std::size_t numbers) {
  const std::optional<std::string> text = call.request.parameter("cursor");
  if (!text) return std::nullopt;
  std::vector<std::uint64_t> place(numbers, 0);
  if (*text == "start") return place;
  const Refusal wrong(400, "cursor is the text that the last answer gave, or start");
  const std::size_t end = text->find(':');
  if (end == std::string::npos) throw wrong;
  const char *at = text->data() + end, *const last = text->data() + text->size();
  for (std::uint64_t& number : place) {
    if (at == last || *at != ':') throw wrong;
    const auto [next, error] = std::from_chars(at + 1, last, number);
    if (error != std::errc()) throw wrong;
    at = next;
  }
  if (at != last) throw wrong;
  if (text->compare(0, end, call.served->set().revision()) != 0)
    throw Refusal(410, "the set has another revision than when this cursor was given; begin again, with cursor=start");
  return place;
}

}  // namespace filiform::tools
