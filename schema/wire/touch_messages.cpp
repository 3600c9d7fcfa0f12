#include <cmath>

#include "core/assert.hpp"
#include "schema/codec/hand_code.hpp"
#include "schema/wire/message_codec.hpp"

// The messages about touch, in both directions.
namespace hairnet::wire {
namespace {

// Decodes one person's hands. kHandsBytesMax is the wire's limit; the decoder itself is bounded by the number of
// shapes.
std::string read_hands(std::span<const std::uint8_t> bytes, std::vector<Hand>& out) {
  if (bytes.size() > kHandsBytesMax)
    return "hands: " + std::to_string(bytes.size()) + " bytes, more than " + std::to_string(kHandsBytesMax);
  return codec::decode_hands(bytes, out);
}

fb::Prop to_struct(const Prop& prop) {
  const Vec3f half_size_m = prop.shape.half_size_m.cast<float>();
  return {to_flatbuffer(half_size_m), static_cast<float>(prop.shape.radius_m),
          to_flatbuffer(prop.place),  prop.number,
          prop.shape.is_inside_out,   prop.has_jumped};
}

Prop from_struct(const fb::Prop& prop) {
  const Vec3f half_size_m = from_flatbuffer(prop.half_size_m());
  return {prop.number(),
          {half_size_m.cast<double>(), prop.radius_m(), prop.is_inside_out()},
          from_flatbuffer(prop.place()),
          prop.has_jumped()};
}

template <class Message>
auto write_props(FlatBufferBuilder& to, const Message& m) {
  std::vector<fb::Prop> props;
  props.reserve(m.props.size());
  for (const Prop& prop : m.props) props.push_back(to_struct(prop));
  return std::pair(to.CreateVectorOfStructs(props), to.CreateVector(m.removed));
}

// Reads the props of SetProps and of RoomProps.
std::string read_props(const auto& in, std::vector<Prop>& props, std::vector<std::uint8_t>& removed) {
  // A room has no more numbers than this, so a longer list must name one twice.
  if (in.props()->size() > kPropsMax || in.removed()->size() > kPropsMax)
    return "props: more than " + std::to_string(kPropsMax);
  if (!is_aligned(*in.props())) return "props: not aligned";
  for (const fb::Prop* prop : *in.props()) props.push_back(from_struct(*prop));
  from_flatbuffer(*in.removed(), removed);
  for (const std::uint8_t number : removed) {
    if (number >= kPropsMax) return "props: number " + std::to_string(number) + " does not exist";
  }
  return {};
}

// Reads the rule of SetTouch and of MemberTouch.
std::string read_rule(const auto& in, auto& out) {
  if (in.chosen()->size() > kTouchChosenMax)
    return "touch: more than " + std::to_string(kTouchChosenMax) + " are chosen";
  from_flatbuffer(*in.chosen(), out.chosen);
  return read_enum(in.audience(), "audience", out.audience);
}

}  // namespace

Offset<fb::Hands> write_hands(FlatBufferBuilder& to, const HandsSample& sample) {
  return fb::CreateHands(to, sample.capture_time_ns, sample.sequence,
                         to.CreateVector(codec::encode_hands(sample.hands)));
}

std::string read_hands(const fb::Hands& in, HandsSample& out) {
  out.sequence = in.sequence();
  std::string error = read_time(in.capture_time_ns(), "hands' capture time", out.capture_time_ns);
  return error.empty() ? read_hands(span_of(in.bytes()), out.hands) : error;
}

std::string validate(const TakeHold& hold) {
  if (hold.hand >= kHandShapesMax) return "hold: a hand has the number of a shape";
  // The comparison is false for NaN.
  const auto is_within = [](float x) { return std::abs(x) <= static_cast<float>(kHandSizeMax_m); };
  for (const float x : hold.place) {
    if (!is_within(x))
      return "hold: its place is more than " + std::to_string(static_cast<int>(kHandSizeMax_m)) + " m from the shape";
  }
  const bool is_radius = hold.radius_m >= 0 && hold.radius_m <= static_cast<float>(kGrabRadiusMax_m);
  static_assert(kGrabRadiusMax_m == 0.3, "the text below has the number");
  return is_radius ? "" : "hold: its radius is not in [0, 0.3] m";
}

std::string validate(const Prop& prop) {
  if (prop.number >= kPropsMax) return "prop: its number is not below " + std::to_string(kPropsMax);
  const Vec3& at = prop.place.position;
  if (!(at.allFinite() && at.cwiseAbs().maxCoeff() <= kPositionMax_m))
    return "prop: a coordinate of its place is more than 10 000 m";
  static_assert(kPositionMax_m == 10'000, "the text above has the number");
  // The rest of the rules is the World's own, so that a room never has a prop that a World refuses.
  return validate(TouchBody{.key = {}, .shape = prop.shape, .place = prop.place});
}

Offset<fb::SetTouch> write(FlatBufferBuilder& to, const SetTouch& m) {
  return fb::CreateSetTouchDirect(to, &m.chosen, m.character, static_cast<fb::TouchAudience>(m.audience));
}

std::string read(const fb::SetTouch& in, SetTouch& out) {
  out.character = in.character();
  return read_rule(in, out);
}

Offset<fb::TakeHold> write(FlatBufferBuilder& to, const TakeHold& m) {
  const fb::Vec3 place = to_flatbuffer(m.place);
  return fb::CreateTakeHold(to, &place, m.member, m.radius_m, m.hand);
}

std::string read(const fb::TakeHold& in, TakeHold& out) {
  out = {in.member(), in.hand(), from_flatbuffer(*in.place()), in.radius_m()};
  return {};
}

Offset<fb::LetGo> write(FlatBufferBuilder& to, const LetGo& m) {
  return fb::CreateLetGo(to, m.member, m.hand, static_cast<fb::Release>(m.release));
}

std::string read(const fb::LetGo& in, LetGo& out) {
  out.member = in.member();
  out.hand = in.hand();
  return read_enum(in.release(), "release", out.release);
}

Offset<fb::SetProps> write(FlatBufferBuilder& to, const SetProps& m) {
  const auto [props, removed] = write_props(to, m);
  return fb::CreateSetProps(to, props, removed);
}

std::string read(const fb::SetProps& in, SetProps& out) {
  return read_props(in, out.props, out.removed);
}

Offset<fb::RoomProps> write(FlatBufferBuilder& to, const RoomProps& m) {
  const auto [props, removed] = write_props(to, m);
  return fb::CreateRoomProps(to, props, removed, m.all);
}

std::string read(const fb::RoomProps& in, RoomProps& out) {
  out.all = in.all();
  // A server's props are validated here: a client shows them at once. Those of SetProps are validated by the session.
  std::string error = read_props(in, out.props, out.removed);
  for (const Prop& prop : out.props) {
    if (error.empty()) error = validate(prop);
  }
  return error;
}

Offset<fb::MemberTouch> write(FlatBufferBuilder& to, const MemberTouch& m) {
  return fb::CreateMemberTouchDirect(to, &m.chosen, m.member, static_cast<fb::TouchAudience>(m.audience));
}

std::string read(const fb::MemberTouch& in, MemberTouch& out) {
  out.member = in.member();
  return read_rule(in, out);
}

Offset<fb::Held> write(FlatBufferBuilder& to, const Held& m) {
  return fb::CreateHeld(to, m.member, m.point_count, m.hand);
}

std::string read(const fb::Held& in, Held& out) {
  out = {in.member(), in.hand(), in.point_count()};
  return {};
}

Offset<fb::RoomHands> write(FlatBufferBuilder& to, const RoomHands& m) {
  // Only tests encode hands this way: a server encodes each person's once for all who get them.
  EncodedRoomHands encoded{m.tick, m.sample_time_ns, {}};
  // Growth of the outer vector moves its elements, whose bytes stay where they are: the spans stay valid.
  std::vector<std::vector<std::uint8_t>> bytes;
  for (const auto& [session, hands] : m.people)
    encoded.people.push_back({session, bytes.emplace_back(codec::encode_hands(hands))});
  return write(to, encoded);
}

Offset<fb::RoomHands> write(FlatBufferBuilder& to, const EncodedRoomHands& m) {
  std::vector<fb::PersonHands> people;
  std::vector<std::uint8_t> bytes;
  for (const auto& [session, hands] : m.people) {
    HAIRNET_ASSERT(hands.size() <= kHandsBytesMax);
    people.emplace_back(session, static_cast<std::uint16_t>(hands.size()));
    bytes.insert(bytes.end(), hands.begin(), hands.end());
  }
  return fb::CreateRoomHands(to, m.tick, m.sample_time_ns, to.CreateVectorOfStructs(people), to.CreateVector(bytes));
}

std::string read(const fb::RoomHands& in, RoomHands& out) {
  const auto& people = *in.people();
  if (people.size() > kMembersPerMessageMax)
    return "hands: of more than " + std::to_string(kMembersPerMessageMax) + " people";
  if (!is_aligned(people)) return "hands: people not aligned";
  out.tick = in.tick();
  if (std::string error = read_time(in.sample_time_ns(), "sample time", out.sample_time_ns); !error.empty())
    return error;
  std::span<const std::uint8_t> left = span_of(in.bytes());
  for (const fb::PersonHands* person : people) {
    // Counts are the peer's, so each is compared with what is left before the span is cut.
    if (person->byte_count() > left.size()) return "hands: fewer bytes than counted";
    RoomHands::Person& next = out.people.emplace_back(RoomHands::Person{person->session(), {}});
    if (std::string error = read_hands(left.first(person->byte_count()), next.hands); !error.empty()) return error;
    left = left.subspan(person->byte_count());
  }
  return left.empty() ? std::string() : "hands: more bytes than counted";
}

}  // namespace hairnet::wire
