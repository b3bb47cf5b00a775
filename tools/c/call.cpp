#include "tools/c/call.h"

#include "device/haptic_device.h"
#include "index/text.h"
#include "tools/words/library_text.h"

#include <algorithm>
#include <array>
#include <exception>
#include <string_view>
#include <system_error>
#include <utility>

namespace filiform::c {

namespace {

constexpr std::size_t kMostText = 2048;
thread_local std::array<char, kMostText> error_text{};

int failWith(int status, std::string_view text) noexcept {
  std::size_t size = std::min(text.size(), kMostText - 1);
  while (size > 0 && size < text.size() && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;
  std::memmove(error_text.data(), text.data(), size);
  error_text[size] = '\0';
  return status;
}

// Options that filiform.h names otherwise or lacks.
constexpr std::pair<std::string_view, std::string_view> kWords[] = {
    {"make one with filiform ingest", "make one without add"},
    {"with --add, --sync and --remove", "with add and sync"},
    {"leave out --add and --remove", "leave out add"},
    {"--delete belongs to --sync; --remove CELL removes one cell", "remove_gone belongs to sync"},
    {"leave out --delete", "leave out remove_gone"},
    {"--memory", "memory_bytes"}};

int failInWords(int status, const Error& error) {
  return failWith(status, tools::inLibraryWords(error.what(), kWords));
}

int translated() {
  try {
    throw;
  } catch (const UsageError& error) {
    return failInWords(FILIFORM_USAGE, error);
  } catch (const Interrupted& error) {
    return failWith(FILIFORM_INTERRUPTED, withShortWords(error.what()));
  } catch (const IoError& error) {
    return failWith(FILIFORM_IO, withShortWords(error.what()));
  } catch (const CorruptSet& error) {
    return failWith(FILIFORM_CORRUPT, withShortWords(error.what()));
  } catch (const UnknownDevice& error) {
    return failInWords(FILIFORM_USAGE, error);
  } catch (const DeviceError& error) {
    return failWith(FILIFORM_IO, withShortWords(error.what()));
  } catch (const Error& error) {
    return failInWords(FILIFORM_INPUT, error);
  } catch (const std::bad_alloc&) {
    return failWith(FILIFORM_NO_MEMORY, "out of memory");
  } catch (const std::system_error& error) {
    return failWith(FILIFORM_IO, "the system refused: " + error.code().message());
  } catch (const std::exception& error) {
    return failWith(FILIFORM_INTERNAL, std::string("internal error: ") + error.what() + " (please report this)");
  } catch (...) {
    return failWith(FILIFORM_INTERNAL, "internal error: an exception without a text (please report this)");
  }
}

}  // namespace

int statusOfException() noexcept {
  try {
    return translated();
  } catch (...) {  // no memory for the text
    return failWith(FILIFORM_NO_MEMORY, "out of memory");
  }
}

}  // namespace filiform::c

extern "C" {

const char* filiform_error_text(void) { return filiform::c::error_text.data(); }

const char* filiform_status_name(int status) {
  static constexpr const char* kNames[] = {"FILIFORM_OK",        "FILIFORM_INPUT",   "FILIFORM_USAGE",
                                           "FILIFORM_IO",        "FILIFORM_CORRUPT", "FILIFORM_INTERRUPTED",
                                           "FILIFORM_NO_MEMORY", "FILIFORM_INTERNAL"};
  return status >= 0 && status < static_cast<int>(std::size(kNames)) ? kNames[status] : "unknown status";
}

const char* filiform_version(void) { return FILIFORM_VERSION; }

void filiform_free(void* array) { std::free(array); }

}  // extern "C"
