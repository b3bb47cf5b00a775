#include "tools/serve/people/people.h"

#include "index/cell/glob.h"
#include "index/errors.h"
#include "index/file/signature.h"
#include "index/text.h"
#include "tools/serve/people/secret.h"
#include "tools/serve/people/toml_file.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <utility>

namespace filiform::tools {

namespace {

constexpr const char* kAnonymous = "anonymous";
constexpr std::size_t kDigestDigits = 64, kMostName = 64;
constexpr std::array kScopes{Scope::read, Scope::metrics, Scope::revoke, Scope::session};

Scope scopeOf(const TomlFile& file, const toml::node& node) {
  const std::string word = file.text("scopes", node);
  for (const Scope scope : kScopes)
    if (word == toString(scope)) return scope;
  file.refuse(node, "unknown scope '" + escaped(word, 40) + "'; known are read, metrics, revoke, session");
}

// A name, or a pattern of names.
std::string nameOf(const TomlFile& file, const toml::node& node) {
  const std::string name = file.text("name", node);
  const bool is_plain = std::all_of(name.begin(), name.end(), [](unsigned char c) { return c > ' ' && c != 0x7f; });
  if (name.empty() || name.size() > kMostName || !is_plain)
    file.refuse(node, "name must be a text of 1 to 64 bytes without blanks");
  return name;
}

struct PersonEntry {
  Person person;
  std::string digest = {};  // of its token
};

PersonEntry entryOf(const TomlFile& file, const toml::table& table, bool has_token, bool has_name) {
  PersonEntry entry;
  Person& person = entry.person;
  person.scopes = {Scope::read, Scope::session};
  for (const auto& [of, value] : table) {
    const std::string key(of.str());
    if (key == "name" && has_name) {
      person.name = person.entry = nameOf(file, value);
    } else if (key == "token" && has_token) {
      person.token = file.text(key, value);
      if (!isFitToken(person.token))
        file.refuse(value, "token must have 16 to 512 letters and digits, such as 'openssl rand -hex 32' prints");
      entry.digest = sha256Digits(person.token);
    } else if (key == "sha256" && has_token) {
      entry.digest = lowerCase(file.text(key, value));
      if (entry.digest.size() != kDigestDigits ||
          entry.digest.find_first_not_of("0123456789abcdef") != std::string::npos)
        file.refuse(value, "sha256 must have 64 hexadecimal digits, such as 'printf %s TOKEN | sha256sum' prints");
    } else if (key == "scopes") {
      person.scopes.clear();
      file.eachOf(key, value, [&](const toml::node& one) { person.scopes.push_back(scopeOf(file, one)); });
    } else if (key == "sets") {
      person.sets.clear();
      file.eachOf(key, value, [&](const toml::node& one) { person.sets.push_back(file.text(key, one)); });
    } else if (key == "requests-per-minute") {
      const auto given = value.value<std::int64_t>();
      if (!given || *given < 1 || *given > std::numeric_limits<int>::max())
        file.refuse(value, "requests-per-minute must be a whole number of at least 1");
      person.requests_per_minute = static_cast<unsigned>(*given);
    } else {
      file.refuse(of.source(), "unknown key '" + escaped(key, 60) + "'; known are " + (has_name ? "name, " : "") +
                                   (has_token ? "token, sha256, " : "") + "scopes, sets, requests-per-minute");
    }
  }
  if (has_name && person.name.empty()) file.refuse(table, "this table needs a name");
  if (has_token && (entry.digest.empty() || table.contains("token") == table.contains("sha256")))
    file.refuse(table, "the table of '" + escaped(person.name, 60) + "' needs either token or sha256");
  if (person.name == kAnonymous) file.refuse(table, "'anonymous' is the name of those without one; give another");
  return entry;
}

}  // namespace

People::People() : anonymous_(std::make_shared<const Person>()) {}

People People::listed() {
  People people;
  people.is_open_ = false;
  people.anonymous_ = nullptr;
  return people;
}

People People::ofToken(const std::string& token) {
  People people = listed();
  people.add({.token = token}, sha256Digits(token));
  return people;
}

void People::add(Person person, const std::string& digest) {
  person.key = "token " + digest;
  const auto added = std::make_shared<const Person>(std::move(person));
  if (!by_digest_.emplace(digest, added).second)
    throw UsageError("'" + escaped(added->name, 60) + "' has the token of another one; give each a token of its own");
  all_.push_back(added);
}

void People::addUsers(Person person) {
  person.key = "user " + person.entry;
  if (person.name.empty()) person.name = person.entry;  // else sees() takes the person for a reader of every set
  users_.push_back(std::make_shared<const Person>(std::move(person)));
  all_.push_back(users_.back());
}

void People::setAnonymous(Person person) {
  person.name = person.entry = kAnonymous;
  anonymous_ = std::make_shared<const Person>(std::move(person));
}

PersonPointer People::byToken(std::string_view token) const {
  const auto found = by_digest_.find(sha256Digits(token));
  return found == by_digest_.end() ? nullptr : found->second;
}

PersonPointer People::user(const std::string& name) const {
  for (const PersonPointer& users : users_) {
    if (!matchesGlob(users->entry, name)) continue;
    Person one = *users;
    one.name = name;
    return std::make_shared<const Person>(std::move(one));
  }
  return nullptr;
}

People readPeople(const std::string& path) {
  const TomlFile file("--tokens", path);
  People people = People::listed();
  for (const auto& [key, node] : file.tables()) {
    if (key == "token" || key == "user") {
      const bool has_token = key == "token";
      file.eachOf(std::string(key.str()), node, [&, &key = key](const toml::node& one) {
        if (!one.is_table()) file.refuse(one, "give a table: [[" + std::string(key.str()) + "]]");
        PersonEntry entry = entryOf(file, *one.as_table(), has_token, true);
        try {
          has_token ? people.add(std::move(entry.person), entry.digest) : people.addUsers(std::move(entry.person));
        } catch (const UsageError& error) {
          file.refuse(one, error.what());
        }
      });
    } else if (key == kAnonymous && node.is_table()) {
      people.setAnonymous(entryOf(file, *node.as_table(), false, false).person);
    } else {
      file.refuse(key.source(), "'" + escaped(key.str(), 60) + "' is unknown; give [[token]], [[user]] or [anonymous]");
    }
  }
  if (people.all().empty() && people.anonymous() == nullptr)
    throw UsageError("--tokens " + inShort(path) + ": has no [[token]], [[user]] or [anonymous]; add one");
  return people;
}

}  // namespace filiform::tools
