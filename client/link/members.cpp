#include "client/link/members.hpp"

#include <algorithm>

namespace hairnet::link {
namespace {

// Between two requests for a keyframe of one member: the answer takes a round trip.
constexpr std::int64_t kKeyframeWait_ns = 500'000'000;

}  // namespace

Members::Joined Members::join(const wire::MemberJoined& joined) {
  Member member;
  member.session = joined.session;
  member.character = joined.character;
  member.groom = joined.groom;
  member.tag = joined.tag;
  member.appearance = joined.appearance;
  if (put(joined.member, std::move(member))) return Joined::is_new;
  return change({joined.member, joined.tag, joined.appearance}) ? Joined::changed : Joined::same;
}

bool Members::change(const wire::MemberChanged& changed) {
  const auto found = members_.find(changed.member);
  if (found == members_.end()) return false;
  Member& member = found->second;
  if (member.tag == changed.tag && member.appearance == changed.appearance) return false;
  member.tag = changed.tag;
  member.appearance = changed.appearance;
  return true;
}

bool Members::add_own(const wire::CharacterAdded& added) {
  Member member;
  member.character = added.character;
  member.groom = added.groom;
  member.own = true;
  return put(added.member, std::move(member));
}

bool Members::put(std::uint32_t number, Member member) {
  const auto [found, is_new] = members_.try_emplace(number);
  Member& known = found->second;
  const bool same = !is_new && known.own == member.own && known.session == member.session &&
                    known.character == member.character && known.groom == member.groom;
  if (same)
    known.confirmed = true;
  else
    known = std::move(member);
  return !same;
}

bool Members::leave(std::uint32_t member) {
  return members_.erase(member) != 0;
}

void Members::remove_own(std::uint32_t character) {
  std::erase_if(members_, [&](const auto& m) { return m.second.own && m.second.character == character; });
}

std::shared_ptr<const LevelGeometry> Members::add_level(wire::LevelRecord record) {
  HAIRNET_ASSERT(record.level != LevelIndex::rigid);
  const std::pair key{record.groom, record.level};
  std::shared_ptr<const KnownLevel> known = catalog_->keep(std::move(record));
  levels_[key] = known;
  for (auto& [number, member] : members_) {
    if (member.groom == key.first) member.levels[static_cast<std::size_t>(key.second)] = known;
  }
  return {known, &known->geometry};
}

// Hashes the number, so that the choice does not depend on the order of arrival.
bool Members::decodes(std::uint32_t number) const {
  if (decode_share_ >= 1) return true;
  const std::uint32_t mixed = number * 0x9e3779b1u;
  return static_cast<double>(mixed) < decode_share_ * 4294967296.0;
}

const KnownLevel* Members::level_of(Member& member, LevelIndex level) const {
  HAIRNET_ASSERT(static_cast<std::size_t>(level) < member.levels.size());
  std::shared_ptr<const KnownLevel>& known = member.levels[static_cast<std::size_t>(level)];
  if (!known) {
    if (const auto found = levels_.find({member.groom, level}); found != levels_.end()) known = found->second;
  }
  return known.get();
}

Members::DecodedFrame Members::decode_frame(const wire::Frame& frame, std::uint64_t tick, std::int64_t now_ns) {
  DecodedFrame decoded;
  const auto found = members_.find(frame.member);
  if (found == members_.end()) return decoded;
  Member& member = found->second;
  if (member.last_tick && tick <= *member.last_tick) return decoded;
  member.last_tick = tick;
  decoded.character = member.own ? member.character : 0;
  decoded.discontinuous = frame.discontinuous || member.discontinuity_pending;
  if (!decodes(frame.member)) {
    decoded.outcome = Outcome::skipped;
    return decoded;
  }
  if (frame.coefficients) decoded.wants_basis = bases_.wanted(member.groom, now_ns);
  if (decode(member, frame, tick, decoded)) {
    decoded.outcome = Outcome::decoded;
    member.discontinuity_pending = member.keyframe_asked = false;
    return decoded;
  }
  decoded.outcome = Outcome::undecodable;
  member.discontinuity_pending = decoded.discontinuous;
  decoded.wants_keyframe = !member.keyframe_asked || now_ns - member.keyframe_asked_ns >= kKeyframeWait_ns;
  if (decoded.wants_keyframe) member.keyframe_asked_ns = now_ns;
  member.keyframe_asked = true;
  return decoded;
}

bool Members::decode(Member& member, const wire::Frame& frame, std::uint64_t tick, DecodedFrame& decoded) const {
  const std::size_t slot = (member.newest + 1) % kSlotCount;
  HistoryEntry& next = member.history[slot];
  next.valid = false;
  const bool is_decoded = frame.coefficients ? decode_coefficients(member, frame, next, decoded.pose)
                                             : decode_nodes(member, frame, tick, next, decoded.pose);
  if (!is_decoded || wire::validate_pose(decoded.pose) != wire::PoseRefusal::none) return false;
  HAIRNET_ASSERT(next.integers.nodes.size() == (next.geometry ? 3 * next.geometry->active_nodes.size() : 0));
  next.valid = true;
  next.tick = tick;
  member.newest = slot;
  decoded.integers = &next.integers;
  decoded.level = next.level;
  decoded.error_class = next.error_class;
  decoded.geometry = next.geometry;
  return true;
}

// While the basis is on its way, the hair is shown at rest.
bool Members::decode_coefficients(const Member& member, const wire::Frame& frame, HistoryEntry& entry,
                                  Pose& pose) const {
  const std::shared_ptr<const KnownBasis> basis = bases_.of(member.groom);
  codec::DecodedFrame coded;
  if (!codec::decode_frame(frame.content, basis ? &basis->code : nullptr, coded)) return false;
  pose = coded.pose;
  const bool rigid = !basis || frame.level == LevelIndex::rigid;
  entry.integers.nodes.clear();
  entry.integers.velocities.clear();
  entry.level = rigid ? LevelIndex::rigid : LevelIndex::high;
  entry.error_class = codec::ErrorClass::quarter_mm;
  entry.geometry = rigid ? nullptr : std::shared_ptr<const LevelGeometry>(basis, &basis->hair.geometry);
  if (rigid) return true;
  std::vector<Vec3f> displacements(basis->hair.basis.node_count);
  displacements_of(basis->hair.basis, coded.coefficients, displacements);
  codec::quantise_nodes(displacements, entry.error_class, entry.integers.nodes);
  return true;
}

bool Members::decode_nodes(Member& member, const wire::Frame& frame, std::uint64_t tick, HistoryEntry& entry,
                           Pose& pose) const {
  const bool rigid = frame.level == LevelIndex::rigid;
  const KnownLevel* level = rigid ? nullptr : level_of(member, frame.level);
  if (!rigid && !level) return false;
  const std::size_t integer_count = rigid ? 0 : 3 * level->geometry.active_nodes.size();
  HAIRNET_ASSERT(frame.order <= codec::kHistoryMax);
  HAIRNET_ASSERT(wire::is_stride(frame.stride));
  std::array<const codec::FrameIntegers*, codec::kHistoryMax> history{};
  for (std::size_t k = 0; k < frame.order; ++k) {
    const HistoryEntry& past = member.history[(member.newest + kSlotCount - k) % kSlotCount];
    if (!past.valid || past.tick != tick - (k + 1) * frame.stride || past.integers.nodes.size() != integer_count)
      return false;
    history[k] = &past.integers;
  }
  if (!codec::decode_frame(frame.content, codec::History(history.data(), frame.order),
                           level ? &level->neighbours : nullptr, frame.velocities, entry.integers))
    return false;
  HAIRNET_ASSERT(entry.integers.velocities.size() == (frame.velocities ? integer_count : 0));
  pose = codec::dequantise_pose(entry.integers);
  entry.level = frame.level;
  entry.error_class = frame.error_class;
  entry.geometry = nullptr;
  if (level) entry.geometry = {member.levels[static_cast<std::size_t>(frame.level)], &level->geometry};
  return true;
}

std::optional<HairSnapshot> Members::hair_of(std::uint32_t character) const {
  const auto found = std::find_if(members_.begin(), members_.end(),
                                  [&](const auto& m) { return m.second.own && m.second.character == character; });
  if (found == members_.end()) return std::nullopt;
  const Member& member = found->second;
  const HistoryEntry& last = member.history[member.newest];
  if (!last.valid || last.integers.nodes.empty()) return std::nullopt;
  HAIRNET_ASSERT(last.level != LevelIndex::rigid && last.geometry);
  // The server may have sent another geometry, or another basis, after the frame.
  const std::shared_ptr<const KnownLevel>& level = member.levels[static_cast<std::size_t>(last.level)];
  const std::shared_ptr<const KnownBasis> basis = bases_.of(member.groom);
  const bool is_current =
      (level && &level->geometry == last.geometry.get()) || (basis && &basis->hair.geometry == last.geometry.get());
  if (!is_current) return std::nullopt;
  return HairSnapshot{member.groom,
                      last.error_class,
                      {last.level, codec::kStep_m[static_cast<std::size_t>(last.error_class)], last.integers.nodes,
                       last.integers.velocities},
                      last.geometry};
}

void Members::forget_frames() {
  for (auto& [number, member] : members_) {
    for (HistoryEntry& past : member.history) past.valid = false;
    member.keyframe_asked = false;
  }
}

void Members::mark_all_unconfirmed() {
  for (auto& [number, member] : members_) member.confirmed = false;
}

std::optional<std::uint32_t> Members::drop_previous_number(std::uint64_t session, std::uint32_t character,
                                                           std::uint32_t member) {
  const auto former = std::find_if(members_.begin(), members_.end(), [&](const auto& m) {
    return !m.second.confirmed && m.first != member && m.second.session == session && m.second.character == character;
  });
  if (former == members_.end()) return std::nullopt;
  const std::uint32_t number = former->first;
  members_.erase(former);
  return number;
}

std::vector<std::uint32_t> Members::drop_unconfirmed() {
  std::vector<std::uint32_t> left;
  for (const auto& [number, member] : members_) {
    if (!member.confirmed && !member.own) left.push_back(number);
  }
  std::erase_if(members_, [](const auto& m) { return !m.second.confirmed; });
  return left;
}

std::vector<std::uint32_t> Members::drop_all() {
  mark_all_unconfirmed();
  levels_.clear();
  return drop_unconfirmed();
}

}  // namespace hairnet::link
