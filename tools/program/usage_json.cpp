#include "tools/program/usage_json.h"

#include <algorithm>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

namespace filiform::tools {

namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> namesOf(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  return names;
}

// "UINT:INT in [1 - 5]" and "TEXT:FILE" state checks behind a colon.
std::string valueTypeOf(const CLI::Option& option) {
  if (option.get_items_expected_max() == 0) return "";
  return option.get_type_name().substr(0, option.get_type_name().find(':'));
}

// The check of CLI::Range and the like, which the type name states: "UINT:INT in [1 - 5]", "FLOAT:NONNEGATIVE".
Json numberRangeOf(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  if (type.ends_with(":NONNEGATIVE")) return {0, nullptr};
  const std::size_t begin = type.find(" in ["), middle = type.find(" - ", begin), end = type.find(']', begin);
  if (begin == std::string::npos || middle == std::string::npos || end == std::string::npos) return nullptr;
  return {Json::parse(type.substr(begin + 5, middle - begin - 5)),
          Json::parse(type.substr(middle + 3, end - middle - 3))};
}

bool repeats(const CLI::Option& option) { return option.get_items_expected_max() > 1000; }

// CLI11 has them in no order.
std::vector<std::string> sortedNames(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back(option->get_name());
  std::sort(names.begin(), names.end());
  return names;
}

Json optionJson(const CLI::Option& option) {
  Json json;
  if (option.nonpositional())
    json["names"] = namesOf(option);
  else
    json["name"] = option.get_name(true, false);
  json["description"] = option.get_description();
  const int most = option.get_items_expected_max();
  const bool is_flag = most == 0;
  json["value"] = is_flag ? Json(nullptr) : Json(valueTypeOf(option));
  json["values"] = most < CLI::detail::expected_max_vector_size ? most : option.get_type_size();
  json["range"] = numberRangeOf(option);
  json["required"] = option.get_required();
  json["repeatable"] = !is_flag && repeats(option);
  json["default"] = option.get_default_str().empty() ? Json(nullptr) : Json(option.get_default_str());
  json["environment"] = option.get_envname().empty() ? Json(nullptr) : Json(option.get_envname());
  json["needs"] = sortedNames(option.get_needs());
  json["excludes"] = sortedNames(option.get_excludes());
  return json;
}

// Lines after two blanks.
std::vector<std::string> examplesOf(const CLI::App& command) {
  std::vector<std::string> examples;
  std::istringstream footer(command.get_footer());
  for (std::string line; std::getline(footer, line);)
    if (line.starts_with("  ")) examples.push_back(line.substr(2));
  return examples;
}

std::string remarksOf(const CLI::App& command) {
  std::string remarks;
  std::istringstream footer(command.get_footer());
  for (std::string line; std::getline(footer, line);)
    if (!line.starts_with("  ") && !line.starts_with("Example")) remarks += (remarks.empty() ? "" : "\n") + line;
  return remarks;
}

void addParts(Json& json, const CLI::App& command) {
  json["arguments"] = Json::array();
  json["options"] = Json::array();
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_group().empty()) continue;  // hidden
    json[option->nonpositional() ? "options" : "arguments"].push_back(optionJson(*option));
  }
  json["examples"] = examplesOf(command);
  json["remarks"] = remarksOf(command);
}

}  // namespace

std::string usageJson(const CLI::App& app, const std::string& version, const std::string& others) {
  Json json;
  json["program"] = app.get_name();
  json["version"] = version;
  json["description"] = app.get_description();
  addParts(json, app);
  const Json more = others.empty() ? Json::array() : Json::parse(others);
  json["commands"] = Json::array();
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    const auto other = std::find_if(more.begin(), more.end(),
                                    [&](const Json& one) { return one.value("name", "") == command->get_name(); });
    if (other != more.end()) {
      json["commands"].push_back(*other);
      continue;
    }
    Json one;
    one["name"] = command->get_name();
    one["description"] = command->get_description();
    addParts(one, *command);
    json["commands"].push_back(std::move(one));
  }
  return json.dump(1, ' ', true, Json::error_handler_t::replace);
}

}  // namespace filiform::tools
