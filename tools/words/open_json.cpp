#include "tools/words/open_json.h"

#include <ostream>

namespace filiform::tools {

namespace {

using Json = nlohmann::ordered_json;

std::string textOfJson(const Json& json, int indent) {
  return json.dump(indent, ' ', true, Json::error_handler_t::replace);
}

}  // namespace

std::string indentedJson(const Json& json, std::size_t level) {
  std::string out;
  for (const char c : textOfJson(json, 1)) {
    out += c;
    if (c == '\n') out.append(level, ' ');
  }
  return out;
}

OpenJson::OpenJson(std::ostream& out, const Json& members, std::size_t level) : out_(out), level_(level) {
  const std::string text = indentedJson(members, level);
  out_ << text.substr(0, text.rfind('\n'));
}

void OpenJson::beginMember(const char* name) { out_ << ",\n" << std::string(level_ + 1, ' ') << '"' << name << "\": "; }

void OpenJson::member(const char* name, const Json& value) {
  beginMember(name);
  out_ << indentedJson(value, level_ + 1);
}

void OpenJson::beginText(const char* name) {
  beginMember(name);
  out_ << '"';
}

void OpenJson::addText(std::string_view piece) {
  const std::string text = textOfJson(Json(piece), -1);
  out_ << std::string_view(text).substr(1, text.size() - 2);
}

void OpenJson::endText() { out_ << '"'; }

void OpenJson::beginList(const char* name) {
  beginMember(name);
  out_ << '[';
  empty_ = true;
}

void OpenJson::beginElement() {
  out_ << (empty_ ? "\n" : ",\n") << std::string(level_ + 2, ' ');
  empty_ = false;
}

void OpenJson::endList() {
  if (!empty_) out_ << '\n' << std::string(level_ + 1, ' ');
  out_ << ']';
}

void OpenJson::end() { out_ << '\n' << std::string(level_, ' ') << '}'; }

}  // namespace filiform::tools
