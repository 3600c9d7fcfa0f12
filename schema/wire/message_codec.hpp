#pragma once

#include <string>

#include "messages_generated.h"
#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/messages.hpp"
#include "schema/wire/text.hpp"

// For *_messages.cpp and packet.cpp alone. Each message has a `write`, and below it a
// `read` that copies the message out of a verified table and returns what is wrong with its values: empty, or one
// line. Counts are checked before memory is taken for them, and no `read` copies the same bytes twice.
namespace hairnet::wire {

using flatbuffers::FlatBufferBuilder;
using flatbuffers::Offset;

// Copies a text that may go to logs and terminals; `name` says in the error which one it is.
inline std::string read_text(const flatbuffers::String* from, const char* name, std::string& to) {
  const std::string_view text = view(from);
  if (!is_text(text))
    return std::string(name) + ": not UTF-8 of at most " + std::to_string(kTextBytesMax) +
           " bytes free of control characters";
  to = text;
  return {};
}

// A tag that is empty is absent.
inline Offset<flatbuffers::Vector<std::uint8_t>> write_tag(FlatBufferBuilder& to, std::string_view tag) {
  if (tag.empty()) return {};
  return to.CreateVector(reinterpret_cast<const std::uint8_t*>(tag.data()), tag.size());
}

inline std::string read_tag(const flatbuffers::Vector<std::uint8_t>* from, std::string& to) {
  if (!from) return {};
  const std::string_view tag(reinterpret_cast<const char*>(from->data()), from->size());
  if (std::string error = validate_tag(tag); !error.empty()) return error;
  to = tag;
  return {};
}

// Times within kTimeMax_ns can be added and subtracted everywhere without an overflow.
inline std::string read_time(std::int64_t from_ns, const char* name, std::int64_t& to_ns) {
  if (from_ns < -kTimeMax_ns || from_ns > kTimeMax_ns) return std::string(name) + ": out of range";
  to_ns = from_ns;
  return {};
}

// A person's hands, within a PoseBatch (touch_messages.cpp).
Offset<fb::Hands> write_hands(FlatBufferBuilder& to, const HandsSample& sample);
std::string read_hands(const fb::Hands& in, HandsSample& out);
// The other `write` of RoomHands (touch_messages.cpp).
Offset<fb::RoomHands> write(FlatBufferBuilder& to, const EncodedRoomHands& hands);

}  // namespace hairnet::wire

#include "codec_generated.h"
