// Checks the outputs of a command before the work begins: no output is an input, no two outputs are the same file, and
// each output can be written. Thread rule: functions without state.
#pragma once

#include <string>
#include <vector>

namespace filiform::tools {

struct NamedPath {
  std::string option;  // as given, for messages: "--csv", or "SCENE" for an argument
  std::string path;    // empty: the option was not given
};

// Throws UsageError if an output is an input, or if two outputs are the same file, the same pipe, or both standard
// output. Files are compared, not names: other spellings, symbolic and hard links count. Every file below an input
// folder is an input. A file that does not exist yet is not an input. Throws IoError if an output is a folder or may
// not be written. Opens no file. O(files below the input folders) if an output is an existing regular file, else O(1).
void checkOutputs(const std::vector<NamedPath>& inputs, const std::vector<NamedPath>& outputs);

// For a command that writes several files into a folder. Throws UsageError if a file directly in the folder is an
// input. Accepts a folder that does not exist, and an empty `folder`.
void checkOutputFolder(const std::vector<NamedPath>& inputs, const NamedPath& folder);

// Returns whether the path leads to this program's standard output: "-", /dev/stdout, or the file to which standard
// output is redirected. False for an empty path, and for a path that cannot be followed.
bool isStandardOutput(const std::string& path);
// Returns whether the path leads to a regular file, or to nothing yet. False in the same two cases.
bool isFileOutput(const std::string& path);

}  // namespace filiform::tools
