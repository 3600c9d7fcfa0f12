#include "client/link/members.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <tuple>

#include "schema/wire/learnt_file.hpp"

namespace hairnet::link {
namespace {

// The step of the displacements in a HairState: a quarter of a millimetre, which nobody sees.
constexpr float kStateStep_m = 0.25e-3f;
// Two frames that lie further apart in time give no velocity, because hair swings back and forth between them.
constexpr std::int64_t kVelocityOver_ns_max = 250'000'000;

// Returns `value` in multiples of `unit`, rounded, and clamped to the symmetric range of 16 bits.
std::int16_t to_integer(float value, float unit) {
  return static_cast<std::int16_t>(std::clamp(std::nearbyint(value / unit), -32767.0f, 32767.0f));
}

FileCatalog& checked(const std::shared_ptr<FileCatalog>& catalog) {
  HAIRNET_ASSERT(catalog);
  return *catalog;
}

Result<KnownBasis> decode_basis(std::span<const std::uint8_t> bytes) {
  return wire::decode_basis(bytes).map([](wire::HairBasis&& basis) { return KnownBasis(std::move(basis)); });
}

}  // namespace

Members::Members(const std::shared_ptr<FileCatalog>& catalog, double decode_share)
    : decode_share_(decode_share),
      bases_({catalog, &checked(catalog).bases}, &decode_basis),
      learnt_({catalog, &catalog->learnt}, &wire::decode_learnt) {}

void Members::announce(const wire::GroomLearnt& announced) {
  learnt_.announce(announced.groom, announced.learnt);
  learnt_announced_.erase(announced.groom);
}

Members::Joined Members::join(const wire::MemberJoined& joined) {
  Member member;
  member.session = joined.session;
  member.character = joined.character;
  member.groom = joined.groom;
  member.tag = joined.tag;
  member.appearance = joined.appearance;
  member.generation = joined.generation;
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
  member.generation = added.generation;
  member.own = true;
  return put(added.member, std::move(member));
}

// A member that is known keeps its frames and only becomes confirmed, so that its hair continues over a resume.
bool Members::put(std::uint32_t number, Member member) {
  const auto [found, is_new] = members_.try_emplace(number);
  Member& known = found->second;
  const bool same = !is_new && known.own == member.own && known.session == member.session &&
                    known.character == member.character && known.groom == member.groom;
  if (same) {
    known.confirmed = true;
    known.generation = member.generation;
  } else {
    // Another character has the number now: nothing of the one before may be shown.
    known = std::move(member);
  }
  return !same;
}

bool Members::leave(std::uint32_t member) {
  return members_.erase(member) != 0;
}

void Members::remove_own(std::uint32_t character) {
  std::erase_if(members_, [&](const auto& m) { return m.second.own && m.second.character == character; });
}

// The choice depends on the number alone, so it is the same in whatever order members arrive.
bool Members::decodes(std::uint32_t number) const {
  if (decode_share_ >= 1) return true;
  // The multiplier is odd and near 2^32 over the golden ratio, which spreads consecutive numbers evenly over 32 bits
  // (Fibonacci hashing).
  const std::uint32_t mixed = number * 0x9e3779b1u;
  return static_cast<double>(mixed) < decode_share_ * 4294967296.0;
}

Members::DecodedFrame Members::decode_frame(const wire::Frame& frame, std::optional<std::uint8_t> generation,
                                            std::uint64_t tick, std::int64_t sample_time_ns, std::int64_t now_ns) {
  DecodedFrame decoded;
  const auto found = members_.find(frame.member);
  if (found == members_.end()) return decoded;
  Member& member = found->second;
  // A datagram may be late, and its number may belong to another character by now, perhaps with another basis.
  if (generation && *generation != member.generation) return decoded;
  if (member.last_tick && tick <= *member.last_tick) {
    // A newer frame has overtaken this one, so this jump would be lost: the next frame is marked in its place.
    if (frame.discontinuous && tick < *member.last_tick) member.discontinuity_pending = true;
    return decoded;
  }
  // The tick counts even if the frame turns out to be undecodable, so that an older frame cannot be shown after it.
  member.last_tick = tick;
  decoded.character = member.own ? member.character : 0;
  decoded.discontinuous = frame.discontinuous || member.discontinuity_pending;
  if (!decodes(frame.member)) {
    decoded.outcome = Outcome::skipped;
    return decoded;
  }
  const bool is_rigid = frame.level == LevelIndex::rigid;
  if (!is_rigid) decoded.wants_basis = wanted(bases_, member.groom, now_ns);
  const std::shared_ptr<const KnownBasis> basis = bases_.of(member.groom);
  const std::shared_ptr<const KnownBasis> basis_before = member.newest.basis;
  // The mark of a jump must reach the program with some frame, or the program would interpolate across the jump.
  if (!decode(member, frame, tick, sample_time_ns, basis, decoded)) {
    member.discontinuity_pending = decoded.discontinuous;
    return decoded;
  }
  follow_learnt(member, basis_before, frame, now_ns, decoded);
  member.discontinuity_pending = false;
  member.waiting.reset();
  // Only a sleeping character's frame is worth keeping: of others the next tick brings a newer one.
  if (!is_rigid && !basis && frame.asleep) {
    member.waiting_content.assign(frame.content.begin(), frame.content.end());
    member.waiting = WaitingFrame{frame, tick, sample_time_ns, decoded};
    member.waiting->frame.content = {};
  }
  return decoded;
}

// Notes the motion by which the network of the member's groom must be stepped for this frame. evaluate() steps the
// networks of many members together.
void Members::follow_learnt(Member& member, const std::shared_ptr<const KnownBasis>& basis_before,
                            const wire::Frame& frame, std::int64_t now_ns, DecodedFrame& decoded) {
  const auto& [newest, before] = std::tie(member.newest, member.before);
  // Without a basis there are no coefficients that the network's could be compared with.
  if (!newest.basis) {
    member.learnt = {};
    return;
  }
  // Residuals are differences of coefficients, and mean nothing in another basis.
  if (basis_before && basis_before != newest.basis) member.learnt = {};
  // Most frames end here: this one is on another level, and nothing of an earlier learnt frame still decays.
  if (frame.level != LevelIndex::learnt && member.learnt.is_idle()) return;
  LearntFrame learnt{.to = &newest.decoded.pose,
                     .is_learnt = frame.level == LevelIndex::learnt,
                     .evaluated = frame.evaluated,
                     .discontinuous = decoded.discontinuous};
  if (before.tick) {
    learnt.from = &before.decoded.pose;
    learnt.ticks = *newest.tick - *before.tick;
  }
  if (learnt.is_learnt) decoded.wants_learnt = wanted(learnt_, member.groom, now_ns);
  std::shared_ptr<const LearntHair> hair = learnt_.of(member.groom);
  if (!hair && learnt.evaluated) {
    decoded.lacks_learnt = true;
    // The frame has no coefficients, and nothing here can compute them: the hair stays as it was.
    if (basis_before == newest.basis) member.newest.decoded.coefficients = before.decoded.coefficients;
    member.learnt = {};
    return;
  }
  const bool is_here = hair && learnt.is_learnt;
  const bool is_first = is_here && learnt_announced_.try_emplace(member.groom).second;
  // The pointers stay valid until evaluate(), because the nodes of the map do not move.
  evaluations_.push_back({&member, learnt, member.learnt.begin(std::move(hair), learnt)});
  if (is_here && !learnt.evaluated) learnt_announced_[member.groom].reset();
  const bool is_gap = learnt.evaluated && member.learnt.is_unsettled() && tells_of_gap(member.groom, *newest.tick);
  if (is_first || is_gap) decoded.evaluates = wire::EvaluateLearnt{member.groom, *learnt_.file_of(member.groom)};
}

// After a gap the network needs kLearntSettled_ticks until its hair is right, and the server's answer takes a while. So
// the server is told once, and again only after that many ticks.
bool Members::tells_of_gap(const wire::GroomHash& groom, std::uint64_t tick) {
  std::optional<std::uint64_t>& announced = learnt_announced_[groom];
  if (announced && tick - *announced < kLearntSettled_ticks) return false;
  announced = tick;
  return true;
}

void Members::evaluate() {
  // step_learnt() steps up to kLearntWidth characters of one groom side by side, so the frames are sorted by their
  // network.
  const auto hair_of_one = [](const Evaluation& e) { return e.motion ? e.member->learnt.hair() : nullptr; };
  // Several frames of one member keep their order.
  std::ranges::stable_sort(evaluations_, std::less<>(), hair_of_one);
  std::array<LearntMotion, kLearntWidth> motions;
  for (std::size_t i = 0; i < evaluations_.size();) {
    const LearntHair* const hair = hair_of_one(evaluations_[i]);
    std::size_t count = 0;
    for (; i < evaluations_.size() && count < motions.size() && hair_of_one(evaluations_[i]) == hair; ++i)
      if (hair) motions[count++] = *evaluations_[i].motion;
    if (count > 0) step_learnt(*hair, std::span(motions).first(count));
  }
  for (const auto& [member, frame, motion] : evaluations_) {
    const bool is_continued = member->before.basis == member->newest.basis;
    member->learnt.finish(
        frame, is_continued ? std::span<const float>(member->before.decoded.coefficients) : std::span<const float>(),
        member->newest.decoded.coefficients);
  }
  evaluations_.clear();
}

// Returns false for bytes that are no frame, or a pose out of range: a server is trusted no more than a client.
bool Members::decode(Member& member, const wire::Frame& frame, std::uint64_t tick, std::int64_t sample_time_ns,
                     const std::shared_ptr<const KnownBasis>& basis, DecodedFrame& decoded) {
  // The frame is decoded into the older of the two, which takes the newest's place only on success. A failure leaves
  // the newest as it was; the older one is gone in any case.
  Moment& moment = member.before;
  moment.basis = nullptr;
  moment.tick.reset();
  decoded.outcome = Outcome::undecodable;
  if (!codec::decode_frame(frame.content, basis ? &basis->code : nullptr, moment.decoded)) return false;
  if (wire::validate_pose(moment.decoded.pose) != wire::PoseRefusal::none) return false;
  moment.tick = tick;
  moment.sample_time_ns = sample_time_ns;
  if (frame.level != LevelIndex::rigid) moment.basis = basis;
  std::swap(member.before, member.newest);
  // Neither a velocity nor a continuation of learnt hair may be computed across a jump.
  if (decoded.discontinuous) member.before.basis = nullptr;
  decoded.outcome = Outcome::decoded;
  decoded.pose = &member.newest.decoded.pose;
  decoded.basis = member.newest.basis;
  if (decoded.basis) decoded.coefficients = member.newest.decoded.coefficients;
  return true;
}

std::vector<Members::WaitingFrame> Members::decode_waiting(const wire::GroomHash& groom) {
  std::vector<WaitingFrame> ready;
  const std::shared_ptr<const KnownBasis> basis = bases_.of(groom);
  if (!basis) return ready;
  for (auto& [number, member] : members_) {
    if (member.groom != groom || !member.waiting) continue;
    WaitingFrame waiting = *std::exchange(member.waiting, std::nullopt);
    // The content of a frame points into its packet, which is gone, so the member keeps a copy.
    waiting.frame.content = member.waiting_content;
    decode(member, waiting.frame, waiting.tick, waiting.sample_time_ns, basis, waiting.decoded);
    ready.push_back(std::move(waiting));
  }
  return ready;
}

// No later frame of a sleeping character would ask for its basis, so a lost request is repeated here.
std::vector<wire::GroomHash> Members::wanted_again(std::int64_t now_ns) {
  std::vector<wire::GroomHash> files;
  for (const auto& [number, member] : members_) {
    if (!member.waiting) continue;
    if (const std::optional<wire::GroomHash> file = wanted(bases_, member.groom, now_ns)) files.push_back(*file);
  }
  return files;
}

std::optional<HairSnapshot> Members::hair_of(std::uint32_t character) const {
  const auto found = std::find_if(members_.begin(), members_.end(),
                                  [&](const auto& m) { return m.second.own && m.second.character == character; });
  if (found == members_.end()) return std::nullopt;
  const auto& [newest, before] = std::tie(found->second.newest, found->second.before);
  // Coefficients of an older basis mean other shapes, which the new server could not read.
  if (!newest.basis || newest.basis != bases_.of(found->second.groom)) return std::nullopt;
  const LevelGeometry& geometry = newest.basis->hair.geometry;
  HairSnapshot hair{found->second.groom, newest.basis, newest.decoded.coefficients, {}};
  hair.state.step_m = kStateStep_m;
  std::vector<Vec3f> now(geometry.active_nodes.size()), past(now.size());
  hairnet::displacements_of(newest.basis->hair.basis, newest.decoded.coefficients, now);
  for (const Vec3f& d : now) {
    for (const float x : d) hair.state.displacements.push_back(to_integer(x, kStateStep_m));
  }
  const std::int64_t elapsed_ns = newest.sample_time_ns - before.sample_time_ns;
  if (before.basis != newest.basis || elapsed_ns <= 0 || elapsed_ns > kVelocityOver_ns_max) return hair;
  hairnet::displacements_of(before.basis->hair.basis, before.decoded.coefficients, past);
  const RigidTransform &head = newest.decoded.pose.head(), &head_before = before.decoded.pose.head();
  for (std::size_t i = 0; i < now.size(); ++i) {
    const Vec3f rest = geometry.lattice.node(geometry.active_nodes[i]);
    const Vec3 moved = head.point((rest + now[i]).cast<double>()) - head_before.point((rest + past[i]).cast<double>());
    // HairState wants the velocity of the node in the world, along the axes of the head: the hair of a moving head then
    // goes on with it.
    const Vec3 velocity = head.rotation.conjugate() * moved / (1e-9 * static_cast<double>(elapsed_ns));
    for (const double x : velocity)
      hair.state.velocities.push_back(to_integer(static_cast<float>(x), wire::kVelocityStepsPer_s * kStateStep_m));
  }
  return hair;
}

void Members::forget_frames() {
  for (auto& [number, member] : members_) {
    member.newest = member.before = {};
    member.learnt = {};
    member.waiting.reset();
  }
}

void Members::mark_all_unconfirmed() {
  for (auto& [number, member] : members_) member.confirmed = false;
}

std::optional<std::uint32_t> Members::drop_previous_number(std::uint64_t session, std::uint32_t character,
                                                           std::uint32_t member) {
  const auto former = std::find_if(members_.begin(), members_.end(), [&](const auto& m) {
    // A character that was removed and added again during the outage has another number; its old one must go before the
    // new one is shown.
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
  // The map has no order, so the numbers are sorted: every standard library then gives the same events.
  std::ranges::sort(left);
  return left;
}

std::vector<std::uint32_t> Members::drop_all() {
  mark_all_unconfirmed();
  return drop_unconfirmed();
}

}  // namespace hairnet::link
