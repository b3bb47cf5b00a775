#include "index/errors.h"

#include "index/text.h"

#include <cerrno>
#include <system_error>

namespace filiform {

CorruptSet::CorruptSet(const std::string& file, std::uint64_t offset, const std::string& what)
    : Error(inShort(file) + ": damaged at byte " + std::to_string(offset) + ": " + what),
      file_(file),
      offset_(offset) {}

CorruptTile::CorruptTile(std::uint32_t tile, const std::string& file, std::uint64_t offset, const std::string& what)
    : CorruptSet(file, offset, "tile " + std::to_string(tile) + ": " + what), tile_(tile) {}

IoError::IoError(const std::string& file, const std::string& what)
    : Error(inShort(file) + ": " + what), reason_(what) {}

IoError::IoError(const std::string& file, const std::string& what, int error_number)
    : IoError(file, what + ": " + std::generic_category().message(error_number)) {
  shortage_ = error_number == EMFILE || error_number == ENFILE || error_number == ENOMEM;
}

}  // namespace filiform
