#include "tools/pictures/png.h"

#include "index/errors.h"
#include "index/output.h"
#include "tools/program/interruption.h"

#include <cmath>
#include <zlib.h>

#include <png.h>

namespace filiform::tools {

namespace {

void appendBigEndian(std::string& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xff);
}

// The chunk that states the size of a pixel, behind IHDR.
void statePixels(std::string& png, double pixel_mm) {
  constexpr std::size_t kEndOfHeader = 33;
  std::string chunk = "pHYs";
  for (int axis = 0; axis < 2; ++axis) appendBigEndian(chunk, static_cast<std::uint32_t>(std::lround(1000 / pixel_mm)));
  chunk += '\1';  // a metre
  std::string whole;
  appendBigEndian(whole, static_cast<std::uint32_t>(chunk.size() - 4));
  whole += chunk;
  appendBigEndian(whole, static_cast<std::uint32_t>(
                             crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), static_cast<uInt>(chunk.size()))));
  png.insert(kEndOfHeader, whole);
}

}  // namespace

std::string pngBytes(const Picture& picture, const PngOptions& options) {
  std::vector<std::uint8_t> with_alpha;
  if (options.alpha != nullptr)
    for (std::size_t i = 0; i < options.alpha->size(); ++i) {
      with_alpha.insert(with_alpha.end(), &picture.rgb[3 * i], &picture.rgb[3 * i] + 3);
      with_alpha.push_back((*options.alpha)[i]);
    }
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(picture.width);
  png.height = static_cast<png_uint_32>(picture.height);
  png.format = options.alpha != nullptr ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  png.flags = PNG_IMAGE_FLAG_FAST;  // a third of the time; a dense picture grows by 1 %
  png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
  std::string bytes(size, '\0');
  if (png_image_write_to_memory(&png, bytes.data(), &size, 0,
                                options.alpha != nullptr ? with_alpha.data() : picture.rgb.data(), 0, nullptr) == 0)
    throw InputError(std::string("cannot encode the picture: ") + png.message);
  bytes.resize(size);
  if (options.pixel_mm > 0) statePixels(bytes, options.pixel_mm);
  return bytes;
}

void writePng(const Picture& picture, const std::string& path, const PngOptions& options) {
  const std::string bytes = pngBytes(picture, options);
  Output out(path, {.cancel = &interruptFlag()});
  out.write(bytes);
  out.finish();
}

}  // namespace filiform::tools
