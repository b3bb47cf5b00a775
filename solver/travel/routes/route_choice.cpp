#include "solver/travel/routes/route_choice.h"

#include "index/errors.h"
#include "index/text.h"

#include <charconv>
#include <optional>
#include <string_view>

namespace filiform {

namespace {

template <class Integer>
std::optional<Integer> parse(std::string_view text) {
  Integer value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || text.empty()) return std::nullopt;
  return value;
}

}  // namespace

RouteChoice routeChoiceOf(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string_view head = std::string_view(text).substr(0, colon);
  const std::string_view tail =
      colon == std::string::npos ? std::string_view() : std::string_view(text).substr(colon + 1);
  if (text == "longest") return {};
  if (head == "random" || head == "tour") {
    const auto seed = parse<std::uint64_t>(tail);
    if (seed) return {.kind = head == "tour" ? RouteChoice::Kind::tour : RouteChoice::Kind::random, .seed = *seed};
    throw UsageError(head == "tour" ? "a tour is tour:SEED with a whole number >= 0, as in tour:1"
                                    : "a random route is random:SEED with a whole number >= 0, as in random:1");
  }
  const auto first = parse<std::int64_t>(head), last = parse<std::int64_t>(tail);
  if (!first || !last)
    throw UsageError("no such route '" + escaped(text, 80) +
                     "': choose FIRST:LAST (two sample ids of the cell), longest, random:SEED or tour:SEED");
  return {.kind = RouteChoice::Kind::between, .first = *first, .last = *last};
}

std::string toString(const RouteChoice& choice) {
  switch (choice.kind) {
    case RouteChoice::Kind::between:
      return std::to_string(choice.first) + ':' + std::to_string(choice.last);
    case RouteChoice::Kind::random:
      return "random:" + std::to_string(choice.seed);
    case RouteChoice::Kind::tour:
      return "tour:" + std::to_string(choice.seed);
    case RouteChoice::Kind::longest:
      break;
  }
  return "longest";
}

}  // namespace filiform
