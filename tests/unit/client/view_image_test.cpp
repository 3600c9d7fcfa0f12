#include <gmock/gmock.h>
#include <png.h>

#include "client/render/renderer.hpp"

namespace hairnet::render {
using namespace draw;

namespace {

// Makes an image of one grey; alpha has the same value, which these tests ignore.
Image plain(int width, int height, std::uint8_t grey) {
  Image image;
  image.width = width;
  image.height = height;
  image.rgba.assign(4 * static_cast<std::size_t>(width * height), grey);
  return image;
}

std::uint8_t red_at(const Image& image, int x, int y) {
  return image.rgba[4 * static_cast<std::size_t>(y * image.width + x)];
}

Image decode(const std::vector<std::uint8_t>& bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  Image image;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) return image;
  png.format = PNG_FORMAT_RGBA;
  image.width = static_cast<int>(png.width);
  image.height = static_cast<int>(png.height);
  image.rgba.resize(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, image.rgba.data(), 0, nullptr) == 0) image.rgba.clear();
  return image;
}

TEST(Png, reads_back_the_same) {
  Image image = plain(37, 11, 0);
  for (std::size_t i = 0; i < image.rgba.size(); ++i) image.rgba[i] = static_cast<std::uint8_t>(i * 7 % 256);
  const auto bytes = encode_png(image);
  ASSERT_TRUE(bytes) << bytes.error();
  const Image back = decode(*bytes);
  EXPECT_EQ(back.width, 37);
  EXPECT_EQ(back.height, 11);
  EXPECT_EQ(back.rgba, image.rgba);
}

TEST(Png, refuses_images_whose_bytes_do_not_fit_their_size) {
  EXPECT_FALSE(encode_png(Image{}));
  Image image = plain(4, 4, 0);
  image.rgba.pop_back();
  EXPECT_FALSE(encode_png(image));
  image.width = -4;
  EXPECT_FALSE(encode_png(image));
}

TEST(ContactSheet, lays_tiles_row_by_row_with_gaps) {
  const std::vector<Image> tiles{plain(6, 5, 10), plain(6, 5, 20), plain(6, 5, 30)};
  // The sheet has two columns, with gaps of 3 px between the tiles and around them.
  const Image sheet = contact_sheet(tiles, 2, 3);
  ASSERT_EQ(sheet.width, 3 + 6 + 3 + 6 + 3);
  ASSERT_EQ(sheet.height, 3 + 5 + 3 + 5 + 3);
  EXPECT_EQ(red_at(sheet, 3, 3), 10);
  EXPECT_EQ(red_at(sheet, 12, 7), 20);
  EXPECT_EQ(red_at(sheet, 8, 11), 30);
  const std::uint8_t paper = red_at(sheet, 0, 0);
  EXPECT_EQ(red_at(sheet, 9, 3), paper);
  EXPECT_EQ(red_at(sheet, 12, 12), paper) << "the missing fourth tile";
}

TEST(ContactSheet, bears_no_tiles_odd_columns_and_odd_sizes) {
  EXPECT_EQ(contact_sheet({}, 3).width, 0);
  const std::vector<Image> tiles{plain(6, 5, 10), plain(9, 2, 20), Image{}};
  EXPECT_EQ(contact_sheet(tiles, 0, 0).height, 15);
  EXPECT_EQ(contact_sheet(tiles, 99, -5).width, 18);
}

TEST(Caption, darkens_dots_inside_its_box_only) {
  Image image = plain(100, 40, 200);
  // The text's upper left corner is at (10, 12), and a dot of a letter is 2 px wide.
  draw_text(image, 10, 12, "Hj", 2);
  int dark = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      if (red_at(image, x, y) == 200) continue;
      ++dark;
      // Two letters of 5 x 7 dots, each dot 2 px wide, with a gap, fit 24 x 16 px.
      EXPECT_TRUE(x >= 10 && x < 10 + 2 * 12 && y >= 12 && y < 12 + 16) << x << ' ' << y;
    }
  }
  EXPECT_GT(dark, 60);
  EXPECT_LT(red_at(image, 10, 12), 100) << "top left dot of H";
}

TEST(Caption, is_cut_at_the_edges) {
  Image image = plain(20, 10, 200);
  const std::size_t size = image.rgba.size();
  // The texts lie partly or wholly outside of the image. A write beyond it would show under the sanitizer.
  draw_text(image, -7, -5, "cut me", 3);
  draw_text(image, 18, 8, "\x01\xff", 1000);
  draw_text(image, 500, 500, "far", 1);
  EXPECT_EQ(image.rgba.size(), size);
}

}  // namespace
}  // namespace hairnet::render
