#include "schema/bytes/crc32.hpp"

#include <gtest/gtest.h>

#include <string>

namespace hairnet::bytes {
namespace {

std::uint32_t crc32_of(const std::string& text, std::uint32_t before = 0) {
  return crc32(std::as_bytes(std::span(text)), before);
}

TEST(Crc32, the_checksum_of_pieces_is_that_of_the_whole) {
  // The CRC-32 of these nine digits is the check value that is published for this polynomial.
  const std::string whole = "123456789";
  EXPECT_EQ(crc32_of(whole), 0xcbf43926u);
  EXPECT_EQ(crc32_of(""), 0u);
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    const std::string first = whole.substr(0, size), second = whole.substr(size);
    EXPECT_EQ(crc32_of(second, crc32_of(first)), crc32_of(whole)) << size;
    // crc32_joined() gives the checksum of a whole whose second part is only known by its checksum and size.
    EXPECT_EQ(crc32_joined(crc32_of(first), crc32_of(second), second.size()), crc32_of(whole)) << size;
  }
}

}  // namespace
}  // namespace hairnet::bytes
