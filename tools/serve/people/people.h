// People: who may ask: the tokens and users that the operator names.
//
//   const People people = readPeople("/etc/filiform/people.toml");
//   if (const PersonPointer person = people.byToken(text)) person->sees("column", {});
//
// Thread rule: immutable after it was made.
#pragma once

#include "tools/serve/people/person.h"

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace filiform::tools {

class People {
 public:
  // Everybody may ask everything.
  People();
  // Whoever has the token may ask everything.
  static People ofToken(const std::string& token);
  // Those may ask whom add(), addUsers() and setAnonymous() list.
  static People listed();

  // A person with a token or its SHA-256, 64 hexadecimal digits in lower case. Throws UsageError if another one has it.
  void add(Person person, const std::string& digest);
  // Users that a proxy names, whose name matches `person.entry`; the first one that was added wins.
  void addUsers(Person person);
  // Who asks without a token or a name.
  void setAnonymous(Person person);

  // True if everybody may ask everything.
  bool isOpen() const { return is_open_; }
  // nullptr: nobody has this token. Takes the same time for each text of the same length.
  PersonPointer byToken(std::string_view token) const;
  // nullptr: this user may not ask.
  PersonPointer user(const std::string& name) const;
  // nullptr: a token or a name is needed.
  const PersonPointer& anonymous() const { return anonymous_; }
  bool hasUsers() const { return !users_.empty(); }
  // Those with a key, in the order in which they were added.
  const std::vector<PersonPointer>& all() const { return all_; }

 private:
  bool is_open_ = true;
  PersonPointer anonymous_;
  std::map<std::string, PersonPointer> by_digest_;
  std::vector<PersonPointer> users_, all_;
};

// Reads the file of --tokens:
//
//   [[token]]
//   name = "ann"
//   token = "..."                     # or sha256 = "...", its SHA-256
//   scopes = ["read", "session"]      # these two unless given; also "metrics", "revoke"
//   sets = ["column", "pilot-*"]      # all unless given
//   requests-per-minute = 600         # no limit unless given
//
//   [[user]]                          # whom a proxy names in the header of --user-header
//   name = "*@lab.example"            # a name or a pattern; the first that matches counts
//
//   [anonymous]                       # who gives neither; refused unless this table is there
//   sets = ["public"]
//
// Throws IoError if the file cannot be read, and UsageError, with the line, for a file that is none of this kind.
People readPeople(const std::string& path);

}  // namespace filiform::tools
