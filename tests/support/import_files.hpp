#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

// Small files of the formats that core/import reads, byte by byte, and the real ones beside the checkout.
namespace hairnet::support {

using Bytes = std::vector<std::byte>;

class ByteWriter {
 public:
  ByteWriter& u8(std::uint32_t value) { return little_endian(value, 1); }
  ByteWriter& u16(std::uint32_t value) { return little_endian(value, 2); }
  ByteWriter& u32(std::uint32_t value) { return little_endian(value, 4); }
  ByteWriter& f32(float value) { return u32(std::bit_cast<std::uint32_t>(value)); }
  ByteWriter& text(std::string_view letters) {
    for (const char letter : letters) u8(static_cast<unsigned char>(letter));
    return *this;
  }
  ByteWriter& zeros_up_to(std::size_t bytes) {
    bytes_.resize(bytes);
    return *this;
  }
  // `count` points with coordinates 0.5, 1.5 … `padding` numbers follow each.
  ByteWriter& points(int count, int padding = 0) {
    for (int i = 0; i < count; ++i) {
      for (int axis = 0; axis < 3; ++axis) f32(static_cast<float>(3 * i + axis) + 0.5f);
      for (int k = 0; k < padding; ++k) f32(1);
    }
    return *this;
  }
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }

 private:
  ByteWriter& little_endian(std::uint32_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) bytes_.push_back(static_cast<std::byte>(value >> (8 * i) & 0xff));
    return *this;
  }
  Bytes bytes_;
};

// Three strands of 3, 1 and 2 points, with segments and transparency.
inline Bytes small_hair() {
  ByteWriter out;
  out.text("HAIR").u32(3).u32(6).u32(1 | 2 | 8).u32(9).zeros_up_to(128);
  out.u16(2).u16(0).u16(1).points(6);
  for (int i = 0; i < 6; ++i) out.f32(0.5f);
  return out.bytes();
}

// Two strands of 3 points.
inline Bytes small_tfx3() {
  return ByteWriter().f32(3).u32(2).u32(3).zeros_up_to(144).u32(160).zeros_up_to(160).points(6).bytes();
}
inline Bytes small_tfx4() {
  return ByteWriter().f32(4).u32(2).u32(3).u32(160).zeros_up_to(160).points(6, 1).bytes();
}

// Three strands of 3, 0 and 2 points.
inline Bytes small_data() {
  return ByteWriter().u32(3).u32(3).points(3).u32(0).u32(2).points(2).bytes();
}

// Empty when there is no such file.
inline Bytes shared_file(const std::string& path) {
  std::ifstream in(std::string(HAIRNET_SHARED_DIR) + "/" + path, std::ios::binary);
  const std::string all{std::istreambuf_iterator<char>(in), {}};
  const auto* bytes = reinterpret_cast<const std::byte*>(all.data());
  return {bytes, bytes + all.size()};
}

inline std::string_view as_text(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace hairnet::support
