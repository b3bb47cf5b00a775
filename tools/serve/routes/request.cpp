#include "tools/serve/routes/request.h"

#include "index/text.h"
#include "tools/words/refusal.h"

#include <charconv>
#include <cmath>

namespace filiform::tools {

namespace {

int hexDigit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string percentDecoded(std::string_view text) {
  std::string decoded;
  decoded.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      decoded += text[i];
      continue;
    }
    const int high = i + 2 < text.size() ? hexDigit(text[i + 1]) : -1;
    const int low = i + 2 < text.size() ? hexDigit(text[i + 2]) : -1;
    if (high < 0 || low < 0) throw Refusal(400, "the URL has a % without two hexadecimal digits; write % as %25");
    decoded += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return decoded;
}

// Calls use(piece) for the pieces between separators.
template <typename Use>
void splitAt(std::string_view text, char separator, const Use& use) {
  for (;;) {
    const std::size_t end = text.find(separator);
    use(text.substr(0, end));
    if (end == std::string_view::npos) return;
    text.remove_prefix(end + 1);
  }
}

double finiteNumber(const std::string& name, std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    throw Refusal(400, name + ": '" + escaped(text, 40) + "' is no finite number");
  return value;
}

}  // namespace

void Request::parseTarget() {
  if (target.empty() || target.front() != '/') throw Refusal(400, "the request's target must begin with /");
  for (const char c : target)
    if (c <= 0x20 || c >= 0x7F || c == '#' || c == '"' || c == '<' || c == '>')
      throw Refusal(400, "the URL holds a character that must be written as %XX");
  const std::string_view all(target);
  const std::size_t question = all.find('?');
  splitAt(all.substr(1, question == std::string_view::npos ? question : question - 1), '/',
          [&](std::string_view part) { parts.push_back(percentDecoded(part)); });
  if (question == std::string_view::npos || question + 1 == all.size()) return;
  splitAt(all.substr(question + 1), '&', [&](std::string_view pair) {
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos)
      throw Refusal(400, "'" + escaped(pair, 40) + "' in the query has no value; give NAME=VALUE");
    const std::string name = percentDecoded(pair.substr(0, equals));
    if (!parameters.emplace(name, percentDecoded(pair.substr(equals + 1))).second)
      throw Refusal(400, "the parameter '" + escaped(name, 40) + "' is given twice");
  });
}

std::string_view Request::header(const std::string& name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? std::string_view() : std::string_view(found->second);
}

std::optional<std::string> Request::parameter(const std::string& name) const {
  const auto found = parameters.find(name);
  if (found == parameters.end()) return std::nullopt;
  return found->second;
}

std::optional<double> Request::number(const std::string& name) const {
  const auto text = parameter(name);
  if (!text) return std::nullopt;
  return finiteNumber(name, *text);
}

std::optional<std::uint64_t> Request::whole(const std::string& name, std::uint64_t least, std::uint64_t most) const {
  const auto text = parameter(name);
  if (!text) return std::nullopt;
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
  if (error != std::errc{} || end != text->data() + text->size() || value < least || value > most)
    throw Refusal(400, name + ": '" + escaped(*text, 40) + "' is no whole number from " + std::to_string(least) +
                           " to " + std::to_string(most));
  return value;
}

bool Request::isFirst(const std::string& name, std::string_view first, std::string_view second) const {
  const auto text = parameter(name);
  if (text && *text != first && *text != second)
    throw Refusal(400, name + " must be " + std::string(first) + " or " + std::string(second));
  return text && *text == first;
}

bool Request::takesGzip() const {
  bool takes = false;
  splitAt(header("accept-encoding"), ',', [&](std::string_view piece) {
    const std::string one = lowerCase(piece);
    const std::size_t weight = one.find("q=");
    const bool is_refused = weight != std::string::npos && one.find_first_of("123456789", weight) == std::string::npos;
    takes = takes || (one.find("gzip") != std::string::npos && !is_refused);
  });
  return takes;
}

std::string redacted(const std::string& target) {
  const std::size_t question = target.find('?');
  std::string text;
  char separator = '\0';
  splitAt(std::string_view(target).substr(0, question), '/', [&](std::string_view part) {
    if (separator != '\0') text += separator;
    separator = '/';
    const bool secret = part.starts_with('~') || part.starts_with("%7e") || part.starts_with("%7E");
    text += secret ? "~..." : part;
  });
  if (question == std::string::npos) return text;
  separator = '?';
  splitAt(std::string_view(target).substr(question + 1), '&', [&](std::string_view pair) {
    std::string name;
    try {
      name = percentDecoded(pair.substr(0, pair.find('=')));
    } catch (const Refusal&) {
      name = "token";  // a name that cannot be read may be that of a token
    }
    text += separator;
    text += name == "token" ? "token=..." : std::string(pair);
    separator = '&';
  });
  return text;
}

bool hasTag(std::string_view header, const std::string& tag) {
  return header == "*" || header.find('"' + tag + '"') != std::string_view::npos;
}

std::vector<double> parseNumbers(const std::string& name, const std::string& text, std::size_t count) {
  std::vector<double> numbers;
  splitAt(text, ',', [&](std::string_view piece) {
    if (numbers.size() <= count) numbers.push_back(finiteNumber(name, piece));
  });
  if (numbers.size() != count)
    throw Refusal(400, name + ": give " + std::to_string(count) + " numbers with commas between, um");
  return numbers;
}

}  // namespace filiform::tools
