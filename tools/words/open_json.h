// A JSON object written member by member, for lists and texts that are too long for memory.
//
//   OpenJson row(std::cout, {{"file", name}}, 0);
//   row.beginList("lines");
//   for (const std::uint64_t line : lines) {
//     row.beginElement();
//     std::cout << line;
//   }
//   row.endList();
//   row.end();
//
// Thread rule: thread-compatible.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

namespace filiform::tools {

// The JSON as ASCII text, indented by one blank a level. The first line is not indented.
std::string indentedJson(const nlohmann::ordered_json& json, std::size_t level);

class OpenJson {
 public:
  // Writes the first members (at least one) and leaves the object open. `level`: the indentation of the object's
  // closing brace. The stream must outlive the object. The caller checks the stream for errors.
  OpenJson(std::ostream& out, const nlohmann::ordered_json& members, std::size_t level);
  void member(const char* name, const nlohmann::ordered_json& value);
  // A text, written piece by piece. No piece may end inside a UTF-8 character.
  void beginText(const char* name);
  void addText(std::string_view piece);
  void endText();
  // A list. The caller writes each element itself after beginElement(), indented by level + 2.
  void beginList(const char* name);
  void beginElement();
  void endList();
  void end();

 private:
  void beginMember(const char* name);
  std::ostream& out_;
  std::size_t level_;
  bool empty_ = true;  // the open list has no element yet
};

}  // namespace filiform::tools
