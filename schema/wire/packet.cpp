#include "core/assert.hpp"
#include "schema/wire/frame_datagram.hpp"
#include "schema/wire/message_codec.hpp"

namespace hairnet::wire {
namespace {

template <class Table>
std::pair<fb::Body, Offset<void>> written(Offset<Table> table) {
  // A copy is needed, since the generated constant has no definition.
  constexpr fb::Body type = fb::BodyTraits<Table>::enum_value;
  return {type, table.Union()};
}

// The functions bulk_bytes() estimate the bytes of a message's bulk, so that the buffer is allocated once and not
// beyond the limit. Too small an estimate costs a copy while the buffer grows. A message without a function here has no
// bulk.
std::size_t bulk_bytes(const GroomChunk& chunk) {
  return chunk.bytes.size();
}
std::size_t bulk_bytes(const GroomData& data) {
  return data.bytes.size();
}
std::size_t bulk_bytes(const Hello& hello) {
  return hello.token.size();
}
std::size_t bulk_bytes(const AddCharacter& add) {
  return add.state ? 2 * (add.state->displacements.size() + add.state->velocities.size()) : 0;
}
std::size_t bulk_bytes(const PoseBatch& batch) {
  return batch.poses.size() * sizeof(fb::PoseSample) + batch.earlier.size() * sizeof(fb::EarlierPose);
}
std::size_t bulk_bytes(const SetProps& set) {
  return set.props.size() * sizeof(fb::Prop);
}
std::size_t bulk_bytes(const RoomProps& room) {
  return room.props.size() * sizeof(fb::Prop);
}
std::size_t bulk_bytes(const RoomHands& hands) {
  std::size_t shape_count = 0;
  for (const RoomHands::Person& person : hands.people) {
    for (const Hand& hand : person.hands) shape_count += hand.shapes.size();
  }
  // One person's hands take most a shape when each hand has one shape; and each person's bytes are rounded up.
  return hands.people.size() * (sizeof(fb::PersonHands) + 1) + shape_count * kHandsBytesMax / kHandShapesMax;
}
std::size_t bulk_bytes(const EncodedRoomHands& hands) {
  std::size_t bytes = hands.people.size() * sizeof(fb::PersonHands);
  for (const EncodedRoomHands::Person& person : hands.people) bytes += person.bytes.size();
  return bytes;
}
std::size_t bulk_bytes(const FrameBatch& batch) {
  std::size_t bytes = 0;
  for (const Frame& f : batch.frames) bytes += frame_bytes(f);
  return bytes;
}
template <class M>
std::size_t bulk_bytes(const M&) {
  return 0;
}

// Encodes a packet; empty when it would exceed kPacketBytesMax. `write_body` returns the body's type, and where the
// builder has it.
template <class WriteBody>
std::vector<std::uint8_t> encoded(std::int64_t clock_ns, std::size_t bulk, const WriteBody& write_body) {
  // A message that cannot fit takes no memory. Its real size is known only after it is written, so that is checked
  // below as well.
  if (bulk > kPacketBytesMax) return {};
  FlatBufferBuilder builder(bulk + kPacketOverheadBytesMax);
  const auto [type, body] = write_body(builder);
  // FlatBuffers leaves out a field with its default value, and set_clock() can only overwrite a field that exists.
  builder.ForceDefaults(clock_ns == 0);
  const auto root = fb::CreateEnvelope(builder, clock_ns, type, body);
  std::vector<std::uint8_t> packet = finish(builder, root, fb::EnvelopeIdentifier());
  if (packet.size() > kPacketBytesMax) packet.clear();
  return packet;
}

template <class... Ms>
std::vector<std::uint8_t> encoded(std::int64_t clock_ns, const std::variant<Ms...>& message) {
  const std::size_t bulk = std::visit([](const auto& m) { return bulk_bytes(m); }, message);
  return encoded(clock_ns, bulk, [&](FlatBufferBuilder& builder) {
    return std::visit([&](const auto& m) { return written(write(builder, m)); }, message);
  });
}

// Names the table of an offset; it is used in decltype alone.
template <class Table>
Table table_of(Offset<Table>);

// Reads the body as M when it is one.
template <class M>
bool read_as(const fb::Envelope& in, Message& out, std::string& error) {
  using Table = decltype(table_of(write(std::declval<FlatBufferBuilder&>(), std::declval<const M&>())));
  const Table* table = in.body_as<Table>();
  if (table) error = read(*table, out.emplace<M>());
  return table != nullptr;
}

// Reads the body as one of Ms.
template <class... Ms>
std::string read_body(const fb::Envelope& in, Message& out, const std::variant<Ms...>* /* kinds */) {
  std::string error;
  // The pack tries one kind after the other and stops at the first that is the body's. The list of kinds is the variant
  // itself, so a decoder for clients has no code for what only clients say.
  const bool is_known = (read_as<Ms>(in, out, error) || ...);
  return is_known ? error : "no message of a kind that this version takes";
}

DecodedPacket refused(DecodeError error, std::string detail) {
  return {error, std::move(detail), {}};
}

// Decodes a packet as one of the messages in the variant Kinds.
template <class Kinds>
DecodedPacket decoded_as(std::span<const std::uint8_t> packet) {
  if (packet.size() > kPacketBytesMax)
    return refused(DecodeError::too_large,
                   std::to_string(packet.size()) + " bytes, more than " + std::to_string(kPacketBytesMax));
  // Bytes of a datagram or a WebSocket may begin anywhere, and FlatBuffers reads numbers in place.
  const AlignedBytes aligned(packet);
  const auto* root = verified_root<fb::Envelope>(aligned.bytes(), fb::EnvelopeIdentifier());
  if (!root) return refused(DecodeError::malformed, "not a whole and valid packet of this protocol");
  DecodedPacket decoded;
  std::string error = read_time(root->clock_ns(), "envelope's clock", decoded.envelope.clock_ns);
  if (error.empty()) error = read_body(*root, decoded.envelope.message, static_cast<const Kinds*>(nullptr));
  return error.empty() ? std::move(decoded) : refused(DecodeError::invalid, std::move(error));
}

}  // namespace

const char* to_string(DecodeError error) {
  switch (error) {
    case DecodeError::none:
      return "none";
    case DecodeError::too_large:
      return "too_large";
    case DecodeError::malformed:
      return "malformed";
    case DecodeError::invalid:
      return "invalid";
  }
  return "unknown";
}

void set_clock(std::span<std::uint8_t> packet, std::int64_t clock_ns) {
  if (is_frame_datagram(packet)) return set_frame_datagram_clock(packet, clock_ns);
  HAIRNET_ASSERT(packet.size() >= kPacketBytesMin);
  // The packet is one of ours, so it is not verified again. GetMutableRoot expects the buffer behind the size prefix.
  auto* root = flatbuffers::GetMutableRoot<flatbuffers::Table>(packet.data() + sizeof(flatbuffers::uoffset_t));
  const bool is_set = root->SetField<std::int64_t>(fb::Envelope::VT_CLOCK_NS, clock_ns, clock_ns);
  HAIRNET_ASSERT(is_set);
}

std::vector<std::uint8_t> encode_packet(const Envelope& envelope) {
  return encoded(envelope.clock_ns, envelope.message);
}

std::vector<std::uint8_t> encode_client_packet(std::int64_t clock_ns, const ClientMessage& message) {
  return encoded(clock_ns, message);
}

std::vector<std::uint8_t> encode_room_hands(std::int64_t clock_ns, const EncodedRoomHands& hands) {
  return encoded(clock_ns, bulk_bytes(hands),
                 [&](FlatBufferBuilder& builder) { return written(write(builder, hands)); });
}

DecodedPacket decode_packet(std::span<const std::uint8_t> packet) {
  return decoded_as<Message>(packet);
}

DecodedPacket decode_server_packet(std::span<const std::uint8_t> packet) {
  return decoded_as<ServerMessage>(packet);
}

}  // namespace hairnet::wire
