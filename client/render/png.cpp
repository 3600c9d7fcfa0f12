#include <png.h>

#include <string>

#include "client/render/renderer.hpp"

namespace hairnet::render {

Result<std::vector<std::uint8_t>> encode_png(const Image& image) {
  const std::size_t bytes = 4 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  if (image.width < 1 || image.height < 1 || image.rgba.size() != bytes) {
    return Refusal("image of " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels with " +
                   std::to_string(image.rgba.size()) + " bytes cannot be encoded");
  }
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGBA;
  // A bound for any picture of this size, so that one call suffices.
  std::vector<std::uint8_t> out(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t size = out.size();
  if (png_image_write_to_memory(&png, out.data(), &size, 0, image.rgba.data(), 0, nullptr) == 0) {
    return Refusal("PNG encoding: " + std::string(png.message));
  }
  out.resize(size);
  out.shrink_to_fit();
  return out;
}

}  // namespace hairnet::render
