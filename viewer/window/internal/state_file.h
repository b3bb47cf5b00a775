// The file of `--state`: holds the last state, as one JSON object. Thread rule: one owner.
#pragma once

#include <string>
#include <utility>

#include <nlohmann/json_fwd.hpp>

namespace filiform::internal {

class StateFile {
 public:
  // An empty path: write() has no effect.
  explicit StateFile(std::string path) : path_(std::move(path)) {}

  // Replaces the file. Never waits: if the path is a pipe without a reader, the state is skipped. A failure is kept for
  // failure(); the next write() tries again. True: it failed, and the write before did not.
  bool write(const nlohmann::ordered_json& state);
  // Why the last write failed; empty: it succeeded.
  const std::string& failure() const { return failure_; }
  bool isOn() const { return !path_.empty(); }

 private:
  std::string path_, failure_;
};

}  // namespace filiform::internal
