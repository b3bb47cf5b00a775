// What a command must know of its outputs before it begins: that none of them is one of its inputs, that no two are the
// same file, and that each can be written. Thread rule: functions without state.
#pragma once

#include <string>
#include <vector>

namespace filiform::tools {

struct NamedPath {
  std::string option;  // as given, for messages: "--csv", or "SCENE" of an argument
  std::string path;    // empty: not given
};

// Throws UsageError where an output is an input (the same file by whatever name: other spellings, symbolic and hard
// links; of an input folder every file below it), or two outputs are one file, one pipe, or both standard output;
// IoError where an output is a folder or may not be written. An output that does not exist yet is no input. Opens
// nothing. O(files below the input folders), only where an output is a regular file that is there.
void checkOutputs(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs);

// For a command that writes files of its own names into a folder: throws UsageError where one that is there is an
// input. A folder that is not there, or `folder` empty, is no mistake.
void checkOutputFolder(const std::vector<NamedPath>& inputs, const NamedPath& folder);

// Does it lead to this program's standard output ("-", /dev/stdout, the file that it is redirected to)? False for an
// empty path and for one that cannot be followed.
bool isStandardOutput(const std::string& path);
// To a regular file, or to none as yet? As above.
bool isFileOutput(const std::string& path);

}  // namespace filiform::tools
