#include "schema/wire/earlier_pose.hpp"
#include "schema/wire/message_codec.hpp"

namespace hairnet::wire {
namespace {

// FlatBuffers writes from the back: strings and vectors exist before the table that refers to them. Structs lie in the
// table, so their plain copies must live until the Create call.
fb::Short3 to_struct(const std::array<std::int16_t, 3>& shorts) {
  return {shorts[0], shorts[1], shorts[2]};
}

std::array<std::int16_t, 3> from_struct(const fb::Short3& shorts) {
  return {shorts.x(), shorts.y(), shorts.z()};
}

fb::EarlierPose to_struct(const EarlierPose& earlier) {
  // The struct names its bones, where the plain one has them by number.
  const auto bone = [&](Bone b) {
    const EarlierPose::Bone& from = earlier.bones[static_cast<std::size_t>(b)];
    return fb::BoneBefore(to_struct(from.turn), to_struct(from.move));
  };
  return {earlier.captured_before_ns, earlier.character,         earlier.sequence_before,    bone(Bone::head),
          bone(Bone::neck),           bone(Bone::left_shoulder), bone(Bone::right_shoulder), bone(Bone::upper_trunk)};
}

EarlierPose from_struct(const fb::EarlierPose& earlier) {
  const auto bone = [](const fb::BoneBefore& from) {
    return EarlierPose::Bone{from_struct(from.turn()), from_struct(from.move())};
  };
  return {earlier.captured_before_ns(),
          earlier.character(),
          earlier.sequence_before(),
          {bone(earlier.head()), bone(earlier.neck()), bone(earlier.left_shoulder()), bone(earlier.right_shoulder()),
           bone(earlier.upper_trunk())}};
}

std::string read_earlier(const flatbuffers::Vector<const fb::EarlierPose*>& in, PoseBatch& out) {
  if (in.size() > kEarlierPosesMax)
    return "pose batch: " + std::to_string(in.size()) + " earlier poses, more than " + std::to_string(kEarlierPosesMax);
  if (!is_aligned(in)) return "pose batch: earlier poses not aligned";
  out.earlier.reserve(in.size());
  for (const fb::EarlierPose* p : in) {
    // An earlier pose is relative to the first pose of its character in the batch; without one it means nothing.
    const PoseSample* later = first_of(out.poses, p->character());
    if (!later)
      return "pose batch: an earlier pose of character " + std::to_string(p->character()) + ", which has no pose";
    if (p->sequence_before() == 0) return "pose batch: an earlier pose with the sequence of the pose";
    // The subtraction cannot overflow: the later time was checked, and the difference has 32 bits.
    std::int64_t captured_ns = later->capture_time_ns - p->captured_before_ns();
    if (std::string error = read_time(captured_ns, "earlier pose's capture time", captured_ns); !error.empty())
      return error;
    out.earlier.push_back(from_struct(*p));
  }
  return {};
}

}  // namespace

Offset<fb::Hello> write(FlatBufferBuilder& to, const Hello& m) {
  // A new session has no secret; the table then leaves it out.
  const fb::Secret secret = to_flatbuffer(m.secret);
  const auto name = to.CreateString(fit_text(m.client_name));
  const auto room = to.CreateString(fit_text(m.room));
  // The token is not made to fit: a changed token has no valid signature.
  const auto token = to.CreateString(m.token);
  return fb::CreateHello(to, m.protocol_version, name, room, token, static_cast<fb::Role>(m.role), m.session,
                         m.session == 0 ? nullptr : &secret, m.message_max, m.redirects, m.datagram_layout, m.trace,
                         m.signs_of_life);
}

std::string read(const fb::Hello& in, Hello& out) {
  out.protocol_version = in.protocol_version();
  const std::string_view token = view(in.token());
  // The length is checked before the copy: anyone may send a Hello.
  if (token.size() > kTokenBytesMax) return "token: longer than " + std::to_string(kTokenBytesMax) + " bytes";
  out.token = token;
  out.session = in.session();
  if (in.secret()) out.secret = from_flatbuffer(*in.secret());
  out.message_max = in.message_max();
  out.redirects = in.redirects();
  out.datagram_layout = in.datagram_layout();
  out.trace = in.trace();
  out.signs_of_life = in.signs_of_life();
  // Every client of this version knows the messages up to this one.
  constexpr auto kMin = static_cast<std::uint8_t>(fb::Body::GroomBasis);
  if (out.message_max < kMin) return "hello: message_max is below " + std::to_string(kMin);
  std::string error = read_text(in.client_name(), "client name", out.client_name);
  if (error.empty()) error = read_text(in.room(), "room", out.room);
  return error.empty() ? read_enum(in.role(), "role", out.role) : error;
}

Offset<fb::GroomOffer> write(FlatBufferBuilder& to, const GroomOffer& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomOffer(to, &hash, m.byte_count);
}

std::string read(const fb::GroomOffer& in, GroomOffer& out) {
  out = {from_flatbuffer(*in.hash()), in.byte_count()};
  // The upper limit is the server's own and travels in its Welcome, so it is not the decoder's business.
  return out.byte_count == 0 ? "groom offer: no bytes" : std::string();
}

Offset<fb::GroomChunk> write(FlatBufferBuilder& to, const GroomChunk& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomChunkDirect(to, &hash, m.offset, &m.bytes);
}

std::string read(const fb::GroomChunk& in, GroomChunk& out) {
  // An empty chunk would make no progress, and a sender could repeat it for nothing.
  const std::size_t byte_count = in.bytes()->size();
  if (byte_count == 0 || byte_count > kGroomChunkBytesMax)
    return "groom chunk: " + std::to_string(byte_count) + " bytes, not in [1, " + std::to_string(kGroomChunkBytesMax) +
           ']';
  out.hash = from_flatbuffer(*in.hash());
  out.offset = in.offset();
  from_flatbuffer(*in.bytes(), out.bytes);
  return {};
}

Offset<fb::AddCharacter> write(FlatBufferBuilder& to, const AddCharacter& m) {
  const fb::Hash groom = to_flatbuffer(m.groom);
  Offset<fb::HairState> state;
  if (m.state) state = fb::CreateHairStateDirect(to, &m.state->displacements, &m.state->velocities, m.state->step_m);
  const Offset<flatbuffers::Vector<std::uint8_t>> tag = write_tag(to, m.tag);
  // The struct is written only where the pointer below is not null; absent means that the receiver chooses.
  const fb::Appearance appearance = to_flatbuffer(m.appearance.value_or(Appearance{}));
  return fb::CreateAddCharacter(to, &groom, m.character, static_cast<fb::LevelIndex>(m.level), state, tag,
                                m.appearance ? &appearance : nullptr);
}

namespace {

std::string read_state(const fb::HairState& in, HairState& out) {
  // The counts are checked before the vectors are copied. The state itself is validated by the session, so that a bad
  // one costs the client its hair's shape and not the message.
  const std::size_t count = in.displacements()->size();
  if (count > kHairStateIntegersMax)
    return "hair state: more than " + std::to_string(kHairStateIntegersMax) + " integers";
  // Without velocities the hair starts at rest in this shape.
  if (in.velocities()->size() != 0 && in.velocities()->size() != count) return "hair state: counts differ";
  out.step_m = in.step_m();
  from_flatbuffer(*in.displacements(), out.displacements);
  from_flatbuffer(*in.velocities(), out.velocities);
  return {};
}

}  // namespace

std::string read(const fb::AddCharacter& in, AddCharacter& out) {
  out.character = in.character();
  out.groom = from_flatbuffer(*in.groom());
  if (std::string error = read_tag(in.tag(), out.tag); !error.empty()) return error;
  if (in.appearance()) out.appearance = from_flatbuffer(*in.appearance());
  if (in.state()) {
    if (std::string error = read_state(*in.state(), out.state.emplace()); !error.empty()) return error;
  }
  return read_enum(in.level(), "level", out.level);
}

std::string validate(const HairState& state) {
  // The number of nodes is not known here: the session compares it with the groom's lattice.
  if (state.displacements.empty() || state.displacements.size() % 3 != 0) return "not 3 integers a node";
  // Integers of 16 bits reach 32 m with the largest step: no hair needs a larger one.
  static_assert(kHairStateStepMax_m == 0.001f, "the text below has the number");
  if (!(state.step_m > 0 && state.step_m <= kHairStateStepMax_m)) return "step_m is not in (0, 0.001]";
  return {};
}

std::string validate_tag(std::string_view tag) {
  if (tag.size() <= kTagBytesMax) return {};
  return "tag: " + std::to_string(tag.size()) + " bytes, more than " + std::to_string(kTagBytesMax);
}

Offset<fb::SetAppearance> write(FlatBufferBuilder& to, const SetAppearance& m) {
  const Offset<flatbuffers::Vector<std::uint8_t>> tag = write_tag(to, m.tag);
  const fb::Appearance appearance = to_flatbuffer(m.appearance.value_or(Appearance{}));
  return fb::CreateSetAppearance(to, tag, m.appearance ? &appearance : nullptr, m.character);
}

std::string read(const fb::SetAppearance& in, SetAppearance& out) {
  out.character = in.character();
  if (in.appearance()) out.appearance = from_flatbuffer(*in.appearance());
  return read_tag(in.tag(), out.tag);
}

Offset<fb::SetLevel> write(FlatBufferBuilder& to, const SetLevel& m) {
  return fb::CreateSetLevel(to, m.character, static_cast<fb::LevelIndex>(m.level));
}

std::string read(const fb::SetLevel& in, SetLevel& out) {
  out.character = in.character();
  return read_enum(in.level(), "level", out.level);
}

Offset<fb::RemoveCharacter> write(FlatBufferBuilder& to, const RemoveCharacter& m) {
  return fb::CreateRemoveCharacter(to, m.character);
}

std::string read(const fb::RemoveCharacter& in, RemoveCharacter& out) {
  out.character = in.character();
  return {};
}

Offset<fb::PoseBatch> write(FlatBufferBuilder& to, const PoseBatch& m) {
  std::vector<fb::PoseSample> poses;
  poses.reserve(m.poses.size());
  for (const PoseSample& p : m.poses)
    poses.emplace_back(p.capture_time_ns, p.character, p.sequence, to_flatbuffer(p.pose), p.teleport);
  const auto poses_at = to.CreateVectorOfStructs(poses);
  // An empty list is left out: most batches of a stream have no earlier poses.
  std::vector<fb::EarlierPose> earlier;
  for (const EarlierPose& p : m.earlier) earlier.push_back(to_struct(p));
  Offset<flatbuffers::Vector<const fb::EarlierPose*>> earlier_at;
  if (!earlier.empty()) earlier_at = to.CreateVectorOfStructs(earlier);
  const Offset<fb::Hands> hands = m.hands ? write_hands(to, *m.hands) : Offset<fb::Hands>();
  return fb::CreatePoseBatch(to, poses_at, earlier_at, hands);
}

std::string read(const fb::PoseBatch& in, PoseBatch& out) {
  const auto& poses = *in.poses();
  if (poses.size() > kPosesPerBatchMax)
    return "pose batch: " + std::to_string(poses.size()) + " poses, more than " + std::to_string(kPosesPerBatchMax);
  if (!is_aligned(poses)) return "pose batch: poses not aligned";
  out.poses.reserve(poses.size());
  for (const fb::PoseSample* p : poses) {
    PoseSample& sample = out.poses.emplace_back();
    sample.character = p->character();
    sample.sequence = p->sequence();
    sample.teleport = p->teleport();
    // The numbers of a pose are not checked here: the server refuses a bad pose alone, and keeps the rest of the batch.
    sample.pose = from_flatbuffer(p->bones());
    if (std::string error = read_time(p->capture_time_ns(), "pose's capture time", sample.capture_time_ns);
        !error.empty())
      return error;
  }
  if (in.earlier()) {
    if (std::string error = read_earlier(*in.earlier(), out); !error.empty()) return error;
  }
  return in.hands() ? read_hands(*in.hands(), out.hands.emplace()) : std::string();
}

Offset<fb::SetMaterial> write(FlatBufferBuilder& to, const SetMaterial& m) {
  const fb::MaterialScale scale = to_flatbuffer(m.scale);
  return fb::CreateSetMaterial(to, &scale, m.character);
}

std::string read(const fb::SetMaterial& in, SetMaterial& out) {
  // Factors are validated by the session, which then answers `material_invalid` and names the range.
  out = {in.character(), from_flatbuffer(*in.scale())};
  return {};
}

Offset<fb::SetWind> write(FlatBufferBuilder& to, const SetWind& m) {
  const fb::Wind wind = to_flatbuffer(m.wind);
  return fb::CreateSetWind(to, &wind, m.wind.carried);
}

std::string read(const fb::SetWind& in, SetWind& out) {
  // The session validates the wind, and answers `wind_invalid`.
  out.wind = from_flatbuffer(*in.wind(), in.carried());
  return {};
}

Offset<fb::Observe> write(FlatBufferBuilder& to, const Observe& m) {
  const fb::Vec3 from = m.from ? to_flatbuffer(*m.from) : fb::Vec3();
  return fb::CreateObserveDirect(to, &m.members, m.from ? &from : nullptr, m.count, m.radius_m, m.stride,
                                 static_cast<fb::ObserveMode>(m.mode), m.error_m, m.bytes_per_s);
}

std::string read(const fb::Observe& in, Observe& out) {
  if (in.members()->size() > kMembersPerMessageMax)
    return "observe: more than " + std::to_string(kMembersPerMessageMax) + " members";
  out.count = in.count();
  // These numbers are validated by the session, which then answers `observe_invalid`.
  out.radius_m = in.radius_m();
  if (in.from()) out.from = from_flatbuffer(*in.from());
  from_flatbuffer(*in.members(), out.members);
  out.stride = in.stride();
  out.error_m = in.error_m();
  out.bytes_per_s = in.bytes_per_s();
  return read_enum(in.mode(), "observe mode", out.mode);
}

std::string validate(const Observe& observe) {
  if (!is_stride(observe.stride)) return "stride is not 1, 2 or 4";
  // Only the mode that uses a value checks it, so that a client may leave the others as they are.
  if (observe.mode == ObserveMode::radius && !(observe.radius_m >= 0 && observe.radius_m <= kObserveRadiusMax_m))
    return "radius_m is not in [0, " + std::to_string(static_cast<int>(kObserveRadiusMax_m)) + "]";
  if (observe.from && !(observe.from->allFinite() && observe.from->cwiseAbs().maxCoeff() <= kPositionMax_m))
    return "the point it is measured from is not finite, or beyond " +
           std::to_string(static_cast<int>(kPositionMax_m)) + " m";
  if (!(observe.error_m >= 0 && observe.error_m <= kObserveErrorMax_m))
    return "error_m is not in [0, " + std::to_string(static_cast<int>(kObserveErrorMax_m)) + "]";
  return {};
}

Offset<fb::ReportImportance> write(FlatBufferBuilder& to, const ReportImportance& m) {
  std::vector<fb::MemberImportance> members;
  members.reserve(m.members.size());
  for (const MemberImportance& i : m.members) members.emplace_back(i.member, i.screen_height, i.in_view);
  return fb::CreateReportImportance(to, to.CreateVectorOfStructs(members));
}

std::string read(const fb::ReportImportance& in, ReportImportance& out) {
  const auto& members = *in.members();
  if (members.size() > kMembersPerMessageMax)
    return "importance: more than " + std::to_string(kMembersPerMessageMax) + " members";
  if (!is_aligned(members)) return "importance: members not aligned";
  out.members.reserve(members.size());
  for (const fb::MemberImportance* m : members) {
    // The negation also refuses what is not a number.
    if (!(m->screen_height() >= 0 && m->screen_height() <= kScreenHeightMax))
      return "importance: screen height not in [0, " + std::to_string(static_cast<int>(kScreenHeightMax)) + "]";
    out.members.push_back({m->member(), m->screen_height(), m->in_view()});
  }
  return {};
}

Offset<fb::GroomRequest> write(FlatBufferBuilder& to, const GroomRequest& m) {
  const fb::Hash hash = to_flatbuffer(m.hash);
  return fb::CreateGroomRequest(to, &hash, m.offset);
}

std::string read(const fb::GroomRequest& in, GroomRequest& out) {
  out = {from_flatbuffer(*in.hash()), in.offset()};
  return {};
}

Offset<fb::EvaluateLearnt> write(FlatBufferBuilder& to, const EvaluateLearnt& m) {
  const fb::Hash groom = to_flatbuffer(m.groom), learnt = to_flatbuffer(m.learnt);
  return fb::CreateEvaluateLearnt(to, &groom, &learnt);
}

std::string read(const fb::EvaluateLearnt& in, EvaluateLearnt& out) {
  out = {from_flatbuffer(*in.groom()), from_flatbuffer(*in.learnt())};
  return {};
}

Offset<fb::Moderate> write(FlatBufferBuilder& to, const Moderate& m) {
  const auto subject = to.CreateString(fit_text(m.subject));
  const auto reason = to.CreateString(fit_text(m.reason));
  return fb::CreateModerate(to, subject, reason, m.session, m.seconds, static_cast<fb::ModerateAction>(m.action));
}

std::string read(const fb::Moderate& in, Moderate& out) {
  out.session = in.session();
  out.seconds = in.seconds();
  std::string error = read_text(in.subject(), "subject", out.subject);
  if (error.empty()) error = read_text(in.reason(), "reason", out.reason);
  return error.empty() ? read_enum(in.action(), "moderation", out.action) : error;
}

Offset<fb::Goodbye> write(FlatBufferBuilder& to, const Goodbye& m) {
  return fb::CreateGoodbye(to, to.CreateString(fit_text(m.detail)), static_cast<fb::GoodbyeReason>(m.reason));
}

std::string read(const fb::Goodbye& in, Goodbye& out) {
  // Reason 0 never travels.
  if (std::string error = read_enum(in.reason(), "goodbye reason", out.reason, GoodbyeReason::client_leaves);
      !error.empty())
    return error;
  return read_text(in.detail(), "goodbye detail", out.detail);
}

}  // namespace hairnet::wire
