#include "tools/pictures/png.h"

#include "index/errors.h"
#include "index/output.h"
#include "tools/program/interruption.h"

#include <png.h>

namespace filiform::tools {

std::string pngBytes(const Picture& picture) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(picture.width);
  png.height = static_cast<png_uint_32>(picture.height);
  png.format = PNG_FORMAT_RGB;
  png.flags = PNG_IMAGE_FLAG_FAST;  // a third of the time; a dense picture grows by 1 %
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&png, bytes.data(), &size, 0, picture.rgb.data(), 0, nullptr) == 0)
    throw InputError(std::string("cannot encode the picture: ") + png.message);
  bytes.resize(size);
  return bytes;
}

void writePng(const Picture& picture, const std::string& path) {
  const std::string bytes = pngBytes(picture);
  Output out(path, {.cancel = &interruptFlag()});
  out.write(bytes);
  out.finish();
}

}  // namespace filiform::tools
