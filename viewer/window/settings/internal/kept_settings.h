// The user's settings, and the file that keeps them. Thread rule: one owner.
#pragma once

#include "viewer/window/settings/internal/messages.h"
#include "viewer/window/settings/settings.h"

#include <optional>
#include <string>

namespace filiform::internal {

class KeptSettings {
 public:
  // Loads the file, or takes the defaults if `reset`. A file that cannot be found or read becomes a message.
  KeptSettings(bool reset, Messages& messages);

  Settings now;
  // There were no kept settings, and `reset` was not set.
  bool isFirst() const { return first_; }

  // Saves the settings, unless they are as this object saved them before. No effect without a path. Throws IoError.
  void save();

 private:
  std::string path_;  // empty: none
  bool first_ = false;
  std::optional<Settings> saved_;
};

}  // namespace filiform::internal
