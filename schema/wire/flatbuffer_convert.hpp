#pragma once

#include <bit>
#include <concepts>
#include <cstring>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "core/assert.hpp"
#include "flatbuffers/flatbuffers.h"
#include "schema/wire/messages.hpp"
#include "types_generated.h"

// Between FlatBuffers and plain structs. For the sources of this folder alone: generated types stop here.
namespace hairnet::wire {

static_assert(std::endian::native == std::endian::little, "bulk data is copied as it lies in the buffer");

fb::Hash to_flatbuffer(const GroomHash& hash);
GroomHash from_flatbuffer(const fb::Hash& hash);

fb::Secret to_flatbuffer(const SessionSecret& secret);
SessionSecret from_flatbuffer(const fb::Secret& secret);

// Rounded to float like rounded_to_wire; decoding gives exactly that pose.
fb::Transform to_flatbuffer(const RigidTransform& bone);
RigidTransform from_flatbuffer(const fb::Transform& bone);

fb::Bones to_flatbuffer(const Pose& pose);
Pose from_flatbuffer(const fb::Bones& bones);

fb::MaterialScale to_flatbuffer(const MaterialScale& scale);
MaterialScale from_flatbuffer(const fb::MaterialScale& scale);

fb::Appearance to_flatbuffer(const Appearance& appearance);
Appearance from_flatbuffer(const fb::Appearance& appearance);

fb::Wind to_flatbuffer(const Wind& wind);
Wind from_flatbuffer(const fb::Wind& wind, bool carried);

inline Vec3f from_flatbuffer(const fb::Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
inline fb::Vec3 to_flatbuffer(const Vec3f& v) {
  return {v.x(), v.y(), v.z()};
}

inline std::string_view view(const flatbuffers::String* text) {
  return text ? text->string_view() : std::string_view();
}

// An enum of enums.fbs into the plain enum of the same names. Returns what is wrong with the value: empty, or one line.
template <class From, class To>
std::string read_enum(From from, const char* name, To& to, To first = To{}, To last = static_cast<To>(From::MAX)) {
  if (from < static_cast<From>(first) || from > static_cast<From>(last))
    return std::string(name) + ' ' + std::to_string(static_cast<unsigned>(from)) + " does not exist";
  to = static_cast<To>(from);
  return {};
}

// The given bytes at an 8-byte boundary, as the verifier and FlatBuffers need them. Bytes that do not lie at one are
// copied.
class AlignedBytes {
 public:
  explicit AlignedBytes(std::span<const std::uint8_t> bytes);
  AlignedBytes(const AlignedBytes&) = delete;
  AlignedBytes& operator=(const AlignedBytes&) = delete;
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  std::vector<std::uint64_t> copy_;
  std::span<const std::uint8_t> bytes_;
};

// Whether the bytes begin as a size-prefixed buffer of that kind; they may end anywhere.
inline bool has_identifier(std::span<const std::uint8_t> bytes, const char* identifier) {
  return bytes.size() >= 12 && std::memcmp(bytes.data() + 8, identifier, 4) == 0;
}

// The root of a size-prefixed buffer, or null when the 8-byte aligned `bytes` are not exactly one valid buffer.
template <class Root>
const Root* verified_root(std::span<const std::uint8_t> bytes, const char* identifier) {
  HAIRNET_ASSERT(reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(std::uint64_t) == 0);
  // The verifier compares the identifier before it has checked that these bytes exist.
  if (bytes.size() < kPacketBytesMin || bytes.size() >= FLATBUFFERS_MAX_BUFFER_SIZE) return nullptr;
  flatbuffers::Verifier::Options limits;
  // These bound the work and the stack that a hostile buffer can cost the verifier. No message or file of ours has
  // more.
  limits.max_depth = 8;
  limits.max_tables = 64;
  flatbuffers::Verifier verifier(bytes.data(), bytes.size(), limits);
  if (!verifier.VerifySizePrefixedBuffer<Root>(identifier)) return nullptr;
  return flatbuffers::GetSizePrefixedRoot<Root>(bytes.data());
}

// Whether the structs of a vector are aligned. The verifier checks only that they lie within the buffer. The builder
// aligns no empty vector, so an empty one counts as aligned.
template <class Struct>
bool is_aligned(const flatbuffers::Vector<const Struct*>& structs) {
  return structs.size() == 0 || reinterpret_cast<std::uintptr_t>(structs.Data()) % alignof(Struct) == 0;
}

// The numbers of a vector; none for an absent one.
template <class T>
std::span<const T> span_of(const flatbuffers::Vector<T>* scalars) {
  return scalars ? std::span<const T>(scalars->data(), scalars->size()) : std::span<const T>();
}

// Copies numbers, or plain structs of the same layout. Asserts that the last struct is whole, which the caller has
// checked.
template <class To, class From>
void from_flatbuffer(const flatbuffers::Vector<From>& from, std::vector<To>& to) {
  static_assert(std::is_arithmetic_v<From> && sizeof(To) % sizeof(From) == 0);
  HAIRNET_ASSERT(from.size() % (sizeof(To) / sizeof(From)) == 0);
  to.resize(from.size() / (sizeof(To) / sizeof(From)));
  if (!to.empty()) std::memcpy(static_cast<void*>(to.data()), from.Data(), to.size() * sizeof(To));
}

// The finished, size-prefixed buffer.
template <class Root>
std::vector<std::uint8_t> finish(flatbuffers::FlatBufferBuilder& builder, flatbuffers::Offset<Root> root,
                                 const char* identifier) {
  builder.FinishSizePrefixed(root, identifier);
  return {builder.GetBufferPointer(), builder.GetBufferPointer() + builder.GetSize()};
}

}  // namespace hairnet::wire
