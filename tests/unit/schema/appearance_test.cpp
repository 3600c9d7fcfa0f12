#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <string>
#include <vector>

#include "schema/wire/messages.hpp"

// Tests tags and appearances on the wire, above all that packets with damage in them are refused.
namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr Appearance kLook{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, 10};

// Describes a message that has both fields. A FlatBuffers table finds its fields by a vtable; the slots are offsets in
// it, in bytes.
struct Carrier {
  const char* name;
  // Both count bytes from the start of the vtable.
  std::size_t tag_slot, appearance_slot;
  std::function<Message(std::string)> make;
};

const std::vector<Carrier>& carriers() {
  static const std::vector<Carrier> all{
      {"AddCharacter", 12, 14, [](std::string tag) { return AddCharacter{7, {}, LevelIndex::low, {}, tag, kLook}; }},
      {"SetAppearance", 4, 6,
       [](std::string tag) {
         return SetAppearance{7, tag, kLook};
       }},
      {"MemberJoined", 12, 14, [](std::string tag) { return MemberJoined{3, 4, 5, {}, tag, kLook}; }},
      {"MemberChanged", 4, 6, [](std::string tag) {
         return MemberChanged{3, tag, kLook};
       }}};
  return all;
}

// Encodes a message with a short tag, and finds the places in the packet that a bad peer may change.
class Packet {
 public:
  explicit Packet(const Carrier& carrier, std::size_t tag_bytes = 8)
      : bytes(encode_packet({1, carrier.make(std::string(tag_bytes, 't'))})) {
    // A packet begins with its size in four bytes, and the offset of the root table follows. The slot of the
    // envelope's body in its vtable is 8.
    const std::size_t root = 4 + get<std::uint32_t>(4);
    const std::size_t body_at = root + get<std::uint16_t>(vtable_of(root) + 8);
    body = body_at + get<std::uint32_t>(body_at);
    vtable = vtable_of(body);
    tag_entry = vtable + carrier.tag_slot;
    appearance_entry = vtable + carrier.appearance_slot;
    tag_offset = body + get<std::uint16_t>(tag_entry);
    tag = tag_offset + get<std::uint32_t>(tag_offset);
    appearance = body + get<std::uint16_t>(appearance_entry);
  }
  template <class T>
  T get(std::size_t at) const {
    T value;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  }
  template <class T>
  void put(std::size_t at, std::size_t value) {
    const T narrow = static_cast<T>(value);
    std::memcpy(bytes.data() + at, &narrow, sizeof narrow);
  }
  // Shortens the packet and corrects its size, so that a decoder does not stop at the size.
  void cut(std::size_t size) {
    bytes.resize(size);
    put<std::uint32_t>(0, size - 4);
  }
  // A table begins with the distance by which its vtable lies before it.
  [[nodiscard]] std::size_t vtable_of(std::size_t table) const {
    return table - static_cast<std::size_t>(static_cast<std::ptrdiff_t>(get<std::int32_t>(table)));
  }

  Bytes bytes;
  // All of these are offsets in `bytes`. `body` is the message's table; the entries are the vtable's for both
  // fields. `tag_offset` holds the distance to `tag`, where the length and the text of the tag stand.
  std::size_t body = 0, vtable = 0, tag_entry = 0, appearance_entry = 0, tag_offset = 0, tag = 0, appearance = 0;
};

struct Damage {
  const char* name;
  std::function<void(Packet&)> apply;
};

// Lists 16 kinds of damage, for each of the four messages.
const std::vector<Damage>& damages() {
  static const std::vector<Damage> all{
      {"a tag one byte longer than the packet",
       [](Packet& p) { p.put<std::uint32_t>(p.tag, p.bytes.size() - p.tag - 3); }},
      {"a tag of 4 GB", [](Packet& p) { p.put<std::uint32_t>(p.tag, 0xffffffff); }},
      {"a tag of 2 GB", [](Packet& p) { p.put<std::uint32_t>(p.tag, 0x80000000); }},
      {"a tag that is its own offset", [](Packet& p) { p.put<std::uint32_t>(p.tag_offset, 0); }},
      {"a tag beyond the packet", [](Packet& p) { p.put<std::uint32_t>(p.tag_offset, p.bytes.size()); }},
      {"a tag at the packet's last byte",
       [](Packet& p) { p.put<std::uint32_t>(p.tag_offset, p.bytes.size() - 1 - p.tag_offset); }},
      {"a tag before the packet", [](Packet& p) { p.put<std::uint32_t>(p.tag_offset, 0xfffffff0); }},
      {"a tag that is not aligned", [](Packet& p) { p.put<std::uint32_t>(p.tag_offset, p.tag - p.tag_offset + 1); }},
      {"a tag's offset beyond the packet", [](Packet& p) { p.put<std::uint16_t>(p.tag_entry, 0x7fff); }},
      {"a tag's offset that is not aligned",
       [](Packet& p) { p.put<std::uint16_t>(p.tag_entry, p.tag_offset - p.body + 1); }},
      {"an appearance beyond the packet", [](Packet& p) { p.put<std::uint16_t>(p.appearance_entry, 0x7fff); }},
      {"an appearance that is not whole",
       [](Packet& p) { p.put<std::uint16_t>(p.appearance_entry, p.bytes.size() - p.body - 9); }},
      {"an appearance of one byte",
       [](Packet& p) { p.put<std::uint16_t>(p.appearance_entry, p.bytes.size() - p.body - 1); }},
      {"a table of fields of odd length",
       [](Packet& p) { p.put<std::uint16_t>(p.vtable, p.get<std::uint16_t>(p.vtable) + 1); }},
      {"a packet that ends in the tag", [](Packet& p) { p.cut(p.tag + 6); }},
      {"a packet that ends in the appearance", [](Packet& p) { p.cut(std::min(p.appearance + 5, p.tag + 3)); }},
  };
  return all;
}

TEST(Appearance, is_refused_in_64_kinds_of_damaged_packets) {
  ASSERT_EQ(carriers().size() * damages().size(), 64u);
  for (const Carrier& carrier : carriers()) {
    ASSERT_EQ(decode_packet(Packet(carrier).bytes).error, DecodeError::none) << carrier.name;
    for (const Damage& damage : damages()) {
      Packet packet(carrier);
      damage.apply(packet);
      const DecodedPacket got = decode_packet(packet.bytes);
      EXPECT_EQ(got.error, DecodeError::malformed) << carrier.name << " with " << damage.name;
      EXPECT_FALSE(got.detail.empty());
    }
  }
}

TEST(Appearance, comes_with_a_tag_of_at_most_256_bytes_of_any_kind) {
  for (const Carrier& carrier : carriers()) {
    for (const std::size_t bytes : {1u, 255u, 256u})
      EXPECT_EQ(decode_packet(Packet(carrier, bytes).bytes).error, DecodeError::none) << carrier.name << ' ' << bytes;
    // The smallest tag that is too long has kTagBytesMax + 1 bytes.
    for (const std::size_t bytes : {257u, 1000u, 65'536u}) {
      const DecodedPacket got = decode_packet(Packet(carrier, bytes).bytes);
      EXPECT_EQ(got.error, DecodeError::invalid) << carrier.name << ' ' << bytes;
      EXPECT_EQ(got.detail, "tag: " + std::to_string(bytes) + " bytes, more than 256");
    }
  }
  std::string every(256, '\0');
  for (std::size_t i = 0; i < every.size(); ++i) every[i] = static_cast<char>(i);
  const DecodedPacket got = decode_packet(encode_packet({1, SetAppearance{1, every, {}}}));
  ASSERT_EQ(got.error, DecodeError::none);
  EXPECT_EQ(std::get<SetAppearance>(got.envelope.message).tag, every);
  EXPECT_FALSE(std::get<SetAppearance>(got.envelope.message).appearance);
}

TEST(Hello, of_a_client_that_knows_too_few_messages_is_refused) {
  const auto error = [](std::uint8_t message_max) {
    Hello hello;
    hello.message_max = message_max;
    return decode_packet(encode_packet({1, hello})).error;
  };
  // Every client of protocol version 4 knows the messages up to GroomBasis, whose number is 28.
  EXPECT_EQ(error(27), DecodeError::invalid);
  EXPECT_EQ(error(28), DecodeError::none) << "of a client that was made before there were more";
  EXPECT_EQ(error(255), DecodeError::none) << "of a newer client";
}

}  // namespace
}  // namespace hairnet::wire
