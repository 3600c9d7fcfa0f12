// Compares what the WebAssembly module has in place of zlib and libsodium with these libraries.
#include <gtest/gtest.h>

#include <random>

#include "client/wasm/blake2b.hpp"
#include "client/wasm/deflate.hpp"
#include "client/wasm/inflate.hpp"
#include "schema/bytes/content_hash.hpp"
#include "schema/bytes/deflate.hpp"

namespace hairnet::wasm {
namespace {

using bytes::InflateError;
using bytes::PackEffort;
using Bytes = std::vector<std::uint8_t>;

// Returns bytes to compress. A `spread` of 0 repeats one byte, and 255 makes noise. Between them, bytes are from a
// small alphabet, and short words come again.
Bytes some_bytes(std::mt19937& random, std::size_t count, unsigned spread) {
  Bytes out(count);
  for (std::uint8_t& byte : out) byte = static_cast<std::uint8_t>(random() % (spread + 1));
  if (spread == 0 || spread == 255) return out;
  for (std::size_t i = 20; i + 20 < count; i += 1 + random() % 60) {
    const std::size_t from = random() % i;
    std::copy_n(out.begin() + static_cast<std::ptrdiff_t>(from), std::min<std::size_t>(random() % 19, i - from),
                out.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return out;
}

void expect_same(std::span<const std::uint8_t> stream, std::size_t byte_count) {
  Bytes wanted(byte_count), got(byte_count);
  const InflateError error = bytes::inflate_into(stream, wanted);
  ASSERT_EQ(inflate_into(stream, got), error);
  if (error == InflateError::none) {
    ASSERT_EQ(got, wanted);
  }
}

// The browser's module has its own small inflater, which must read every file that the C++ library packs with zlib.
TEST(WasmInflate, reads_what_zlib_writes) {
  std::mt19937 random(1);
  for (const unsigned spread : {0u, 3u, 20u, 90u, 255u}) {
    for (const std::size_t count : {1u, 2u, 100u, 5000u, 70'000u, 1'000'000u}) {
      const Bytes bytes = some_bytes(random, count, spread);
      for (const PackEffort effort : {PackEffort::most, PackEffort::quick}) {
        Bytes got(count);
        ASSERT_EQ(inflate_into(bytes::deflated(bytes, effort), got), InflateError::none) << count << " of " << spread;
        ASSERT_EQ(got, bytes);
      }
    }
  }
}

TEST(WasmInflate, reads_matches_that_reach_into_themselves_and_far_back) {
  std::mt19937 random(2);
  Bytes bytes = some_bytes(random, 32'768, 255);
  // The repeated bytes lie 32 768 bytes back, the farthest that deflate can reach. The run of one byte is a match that
  // overlaps itself.
  bytes.insert(bytes.end(), bytes.begin(), bytes.begin() + 600);
  bytes.insert(bytes.end(), 10'000, std::uint8_t{7});
  Bytes got(bytes.size());
  ASSERT_EQ(inflate_into(bytes::deflated(bytes, PackEffort::most), got), InflateError::none);
  EXPECT_EQ(got, bytes);
}

// A stream that ends early or late is damaged, and a page must say so as the C++ library does.
TEST(WasmInflate, refuses_each_stream_that_is_cut_off_and_any_that_is_too_long) {
  std::mt19937 random(3);
  const Bytes bytes = some_bytes(random, 3000, 20);
  for (const PackEffort effort : {PackEffort::most, PackEffort::quick}) {
    Bytes stream = bytes::deflated(bytes, effort);
    for (std::size_t size = 0; size < stream.size(); ++size) {
      Bytes got(bytes.size());
      ASSERT_EQ(inflate_into(std::span(stream).first(size), got), InflateError::wrong_length);
    }
    stream.push_back(0);
    Bytes got(bytes.size());
    EXPECT_EQ(inflate_into(stream, got), InflateError::wrong_length);
    stream.pop_back();
    for (const std::size_t count : {std::size_t{1}, bytes.size() - 1, bytes.size() + 1}) expect_same(stream, count);
  }
}

TEST(WasmInflate, takes_and_refuses_the_damaged_streams_that_zlib_does) {
  std::mt19937 random(4);
  int refused = 0, taken = 0;
  for (int n = 0; n < 30'000; ++n) {
    const std::size_t count = 1 + random() % 400;
    const Bytes bytes = some_bytes(random, count, std::array{3u, 20u, 255u}[random() % 3]);
    Bytes stream = bytes::deflated(bytes, random() % 2 == 0 ? PackEffort::most : PackEffort::quick);
    for (auto changes = 1 + random() % 3; changes > 0; --changes) {
      // Mostly in the first bytes, which say what the codes are.
      const std::size_t at = random() % (random() % 2 == 0 ? stream.size() : std::min<std::size_t>(stream.size(), 60));
      stream[at] = static_cast<std::uint8_t>(random() % 2 == 0 ? stream[at] ^ 1u << random() % 8 : random());
    }
    Bytes wanted(count), got(count);
    const InflateError error = bytes::inflate_into(stream, wanted);
    ASSERT_EQ(inflate_into(stream, got), error) << "stream " << n;
    if (error == InflateError::none) {
      ASSERT_EQ(got, wanted) << "stream " << n;
    }
    ++(error == InflateError::none ? taken : refused);
  }
  EXPECT_GT(refused, 1000);
  EXPECT_GT(taken, 1000);
}

TEST(WasmInflate, takes_and_refuses_the_random_bytes_that_zlib_does) {
  std::mt19937 random(5);
  for (int n = 0; n < 200'000; ++n) {
    Bytes stream(random() % 60);
    for (std::uint8_t& byte : stream) byte = static_cast<std::uint8_t>(random());
    if (!stream.empty()) stream[0] = static_cast<std::uint8_t>((stream[0] & ~7u) | 1u | random() % 3 << 1);
    expect_same(stream, 1 + random() % 100);
    if (HasFatalFailure()) return;
  }
}

// Grooms that a page packs are read by the server with zlib.
TEST(WasmDeflate, writes_what_zlib_reads) {
  std::mt19937 random(6);
  for (const unsigned spread : {0u, 1u, 20u, 255u}) {
    for (const std::size_t count : {1u, 2u, 100u, 65'535u, 65'536u, 65'537u, 300'000u}) {
      const Bytes bytes = some_bytes(random, count, spread);
      const Bytes stream = deflated(bytes);
      Bytes got(count);
      ASSERT_EQ(bytes::inflate_into(stream, got), InflateError::none) << count << " of " << spread;
      ASSERT_EQ(got, bytes);
      EXPECT_LE(stream.size(), bytes.size() + bytes.size() / 100 + 160);
    }
  }
}

// Byte counts that grow like the Fibonacci numbers make the longest Huffman codes. Deflate allows 15 bits, so the codes
// must be shortened.
TEST(WasmDeflate, keeps_codes_short_where_few_bytes_are_rare) {
  Bytes bytes;
  for (std::uint8_t byte = 0, a = 1, b = 1; byte < 11; ++byte) {
    bytes.insert(bytes.end(), a, byte);
    const auto next = static_cast<std::uint8_t>(a + b);
    a = b;
    b = next;
  }
  std::size_t a = 89, b = 144;
  for (std::uint8_t byte = 11; bytes.size() < 60'000; ++byte) {
    bytes.insert(bytes.end(), b, byte);
    b += std::exchange(a, b);
  }
  Bytes got(bytes.size());
  ASSERT_EQ(bytes::inflate_into(deflated(bytes), got), InflateError::none);
  EXPECT_EQ(got, bytes);
}

// The hash names a groom for client and server, so both must compute the same one.
TEST(WasmHash, is_that_of_libsodium_however_the_bytes_come) {
  std::mt19937 random(7);
  for (std::size_t count = 0; count < 700; ++count) {
    const Bytes bytes = some_bytes(random, count, 255);
    bytes::ContentHasher wanted;
    wanted.add(bytes);
    Blake2b got;
    for (std::size_t begin = 0; begin < count;) {
      const std::size_t size = std::min<std::size_t>(count - begin, random() % 200);
      got.add(std::span(bytes).subspan(begin, size));
      EXPECT_EQ(got.hash(), got.hash());
      begin += size;
    }
    ASSERT_EQ(got.hash(), wanted.hash()) << count << " bytes";
  }
}

}  // namespace
}  // namespace hairnet::wasm
