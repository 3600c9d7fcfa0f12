#include <algorithm>

#include "client/render/renderer.hpp"

namespace hairnet::render {

// A tile of another size than the first is cropped to it, or leaves paper around it; a missing tile is paper white.
Image contact_sheet(std::span<const Image> tiles, int columns, int gap_px) {
  if (tiles.empty() || tiles[0].width < 1 || tiles[0].height < 1) return {};
  // The grey of the sheet between the tiles: nearly white.
  constexpr std::uint8_t kPaper = 246;
  columns = std::clamp(columns, 1, static_cast<int>(tiles.size()));
  gap_px = std::max(gap_px, 0);
  const int rows = (static_cast<int>(tiles.size()) + columns - 1) / columns;
  const int width = tiles[0].width, height = tiles[0].height;
  Image sheet;
  sheet.width = columns * width + (columns + 1) * gap_px;
  sheet.height = rows * height + (rows + 1) * gap_px;
  sheet.rgba.assign(4 * static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height), kPaper);
  // The paper is opaque: every fourth byte is its alpha.
  for (std::size_t i = 3; i < sheet.rgba.size(); i += 4) sheet.rgba[i] = 255;
  for (std::size_t i = 0; i < tiles.size(); ++i) {
    const Image& tile = tiles[i];
    const int left = gap_px + static_cast<int>(i) % columns * (width + gap_px);
    const int top = gap_px + static_cast<int>(i) / columns * (height + gap_px);
    for (int y = 0; y < std::min(height, tile.height); ++y) {
      const auto from = tile.rgba.begin() + 4 * static_cast<std::ptrdiff_t>(y) * tile.width;
      const auto to = sheet.rgba.begin() + 4 * (static_cast<std::ptrdiff_t>(top + y) * sheet.width + left);
      std::copy_n(from, 4 * std::min(width, tile.width), to);
    }
  }
  return sheet;
}

}  // namespace hairnet::render
