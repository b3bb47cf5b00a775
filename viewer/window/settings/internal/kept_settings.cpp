#include "viewer/window/settings/internal/kept_settings.h"

#include "index/errors.h"

#include <filesystem>

namespace filiform::internal {

KeptSettings::KeptSettings(bool reset, Messages& messages) {
  std::string warning;
  try {
    path_ = Settings::path();
    first_ = !reset && !std::filesystem::exists(path_);
    if (!reset) now = Settings::load(path_, warning);
  } catch (const Error& error) {
    warning = error.what();
  }
  if (!warning.empty()) messages.say(warning);
}

void KeptSettings::save() {
  if (path_.empty() || now == saved_) return;
  now.save(path_);
  saved_ = now;
}

}  // namespace filiform::internal
