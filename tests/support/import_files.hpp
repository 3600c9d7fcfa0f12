#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "client/assets/import/strands.hpp"

// Small strand files made in memory, and the real ones where they are.
namespace hairnet::test {

// Collects little-endian numbers, as most binary formats have them.
class Bytes {
 public:
  Bytes& u16(std::uint16_t value) { return little_endian(value, 2); }
  Bytes& u32(std::uint32_t value) { return little_endian(value, 4); }
  Bytes& f32(float value) { return u32(std::bit_cast<std::uint32_t>(value)); }
  Bytes& zeros(std::size_t count) {
    bytes_.resize(bytes_.size() + count);
    return *this;
  }
  // Appends a point whose coordinates follow from its index, so that tests can tell points apart.
  Bytes& point(std::uint32_t index) {
    const auto i = static_cast<float>(index);
    return f32(i).f32(-0.5f * i).f32(100 + i);
  }
  [[nodiscard]] std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  Bytes& little_endian(std::uint32_t value, int count) {
    for (int i = 0; i < count; ++i) bytes_.push_back(static_cast<std::byte>(value >> (8 * i)));
    return *this;
  }
  std::vector<std::byte> bytes_;
};

// Makes the header of Cem Yuksel's .hair files. It has 128 bytes and begins with "HAIR", which is 0x52494148 in
// little endian. `arrays` has a bit for each array that the file has, and `segments` is the number of segments of
// all strands where there is no array of them.
inline Bytes yuksel_header(std::uint32_t strands, std::uint32_t points, std::uint32_t arrays, std::uint32_t segments) {
  Bytes out;
  out.u32(0x52494148).u32(strands).u32(points).u32(arrays).u32(segments).zeros(128 - 20);
  return out;
}

// Makes strands of 2, 1 and 3 points, with every array that the format has.
inline std::vector<std::byte> yuksel_file() {
  // The bits of 31 announce all five arrays of the format.
  Bytes out = yuksel_header(3, 6, 31, 0);
  out.u16(1).u16(0).u16(2);
  for (std::uint32_t i = 0; i < 6; ++i) out.point(i);
  // For each point a thickness, a transparency and a colour.
  return out.zeros(6 * (4 + 4 + 12)).take();
}

// Make headers of .tfx files. A header of version 3 has 148 bytes, and one of version 4 has 160. `points` is the
// number of points of each strand, and `offset` is where they begin.
inline Bytes tressfx3_header(std::uint32_t strands, std::uint32_t points, std::uint32_t offset) {
  Bytes out;
  out.f32(3).u32(strands).u32(points).zeros(132).u32(offset);
  return out;
}

inline Bytes tressfx4_header(std::uint32_t strands, std::uint32_t points, std::uint32_t offset) {
  Bytes out;
  out.f32(4).u32(strands).u32(points).u32(offset).zeros(144);
  return out;
}

// Makes two strands of three points, with 8 bytes of something else before them.
inline std::vector<std::byte> tressfx3_file() {
  Bytes out = tressfx3_header(2, 3, 156).zeros(8);
  for (std::uint32_t i = 0; i < 6; ++i) out.point(i);
  return out.take();
}

// Makes the same strands, with an inverse mass after each point and other arrays behind all points.
inline std::vector<std::byte> tressfx4_file() {
  Bytes out = tressfx4_header(2, 3, 160);
  for (std::uint32_t i = 0; i < 6; ++i) out.point(i).f32(1);
  return out.zeros(16).take();
}

// Makes strands of 2, 1 and 3 points. Each strand begins with its number of points.
inline std::vector<std::byte> usc_file() {
  Bytes out;
  out.u32(3).u32(2).point(0).point(1).u32(1).point(2).u32(3).point(3).point(4).point(5);
  return out.take();
}

// Returns the folder ../shared/data beside the checkout, which may not be there. Tests that need its files are then
// skipped.
inline std::filesystem::path shared_data() {
  return std::filesystem::path(HAIRNET_SHARED_DIR);
}

inline std::string file_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

inline std::vector<std::byte> file_bytes(const std::filesystem::path& file) {
  const std::string text = file_text(file);
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

}  // namespace hairnet::test
