#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include "tests/whole/player.hpp"

// The promises of a server that a well-behaved client checks.
namespace hairnet::whole {
namespace {

using wire::ErrorReason;
using wire::GoodbyeReason;

// The longest time between the run of a tick and the arrival of its frame at a steady client, without the network's own
// delay. It is twice the period in which ServerHost polls its server's connections (kIoPeriod_ns).
constexpr std::int64_t kFrameLateness_ns = 40 * kMs;

// A server coarsens the hair of small heads, but of none as if it were lower than kSmallestHeight of the screen
// (server/tick/publish.cpp). An error of kFinest_m is always allowed, also where a client asks for none.
constexpr float kSmallestHeight = 0.02f, kFinest_m = 0.5e-3f;

// The distance between two lists of coefficients, m. Missing ones are 0.
float apart(std::span<const float> got, std::span<const float> wanted) {
  float squares = 0;
  for (std::size_t k = 0; k < std::max(got.size(), wanted.size()); ++k)
    squares += std::pow((k < got.size() ? got[k] : 0) - (k < wanted.size() ? wanted[k] : 0), 2.0f);
  return std::sqrt(squares);
}

// Returns the largest error that hair may have at a client which has asked for `error_m` on a head that fills the
// screen. Smaller heads may have a larger error. Each octave of a throttled connection doubles it.
float max_apart(float error_m, int coarser_octaves) {
  if (coarser_octaves > 0) error_m = std::ldexp(std::max(error_m, kFinest_m), coarser_octaves);
  return std::max(error_m / kSmallestHeight, kFinest_m);
}

}  // namespace

bool Player::must_be_resumed() const {
  if (broken_ns_ < 0 || !had_character_ || broken_host_ != host_ || broken_life_ != host_->life() ||
      host_->gave_up_since(plan_.room, broken_ns_))
    return false;
  // The server may drop the session after the shortest of these times. The check demands a resume only within half of
  // that, less 100 ms, since the two ends notice the break at different times.
  const server::SessionLimits& limits = host_->config().sessions;
  const std::int64_t min_ns = std::min({limits.resume_grace_ns, limits.slow_consumer_ns, limits.idle_timeout_ns});
  return timeline_->now_ns() - broken_ns_ + 100 * kMs < min_ns / 2;
}

// Whether a request about touch may be refused so: its member may have left, or may allow it no more.
bool is_of_touch(ErrorReason reason) {
  return reason == ErrorReason::character_unknown || reason == ErrorReason::not_allowed;
}

struct Player::EventHandler {
  Player& p;

  void operator()(const link::Connected& e) const {
    p.journal_->mix(e.welcome.session);
    p.journal_->count("welcomed");
    const bool resumed = e.again && e.welcome.resumed;
    if (!resumed || p.groom_wanted_ns_ >= 0) p.groom_wanted_ns_ = p.timeline_->now_ns();
    if (!resumed) {
      p.welcomed_ns_ = p.timeline_->now_ns();
      p.members_.clear();
    }
    // RoomProps and RoomHands follow where the room has any.
    p.room_props_.clear();
    p.hands_of_others_.clear();
    if (p.calm_) p.end_touch();
    for (auto& [number, member] : p.members_) {
      member.frames = 0;
      member.asleep = false;
    }
    p.has_session_ = true;
    if (resumed) p.haired_.clear();
    const bool must_be_resumed = p.must_be_resumed();
    const std::int64_t broken_ns = std::exchange(p.broken_ns_, -1);
    // The line may have lost the goodbye. A client that reads too slowly has not read the goodbye either.
    const auto broken = std::exchange(p.broken_connection_, nullptr);
    const bool may_be_slow = (p.plan_.quality.lossy || (broken && broken->was_drained())) &&
                             p.host_->metrics(p.host_->life()).session.sessions_closed_by_server_slow.value() > 0;
    if (e.again && must_be_resumed && !e.welcome.resumed && !may_be_slow)
      p.fault("is not resumed " + std::to_string((p.timeline_->now_ns() - broken_ns) / kMs) +
              " ms after its connection broke");
  }
  void operator()(const link::Reconnecting& e) const {
    p.journal_->mix(static_cast<std::uint64_t>(e.reason));
    p.journal_->count("lost, " + std::string(wire::to_string(e.reason)));
    if (e.reason == GoodbyeReason::server_full && p.must_be_resumed())
      p.fault("finds the server full, which has its session");
    const bool had_session = std::exchange(p.has_session_, false);
    for (const auto& [number, member] : p.members_)
      if (had_session && member.own && member.hair) p.haired_.insert(server::number_of(member.key));
    const bool is_sent_on = had_session && p.broken_ns_ < 0 &&
                            (e.reason == GoodbyeReason::none || e.reason == GoodbyeReason::server_draining);
    if (is_sent_on) {
      p.journal_->count(e.reason == GoodbyeReason::none ? "session sent on" : "session ended by a drain");
      if (!p.host_->gave_up_since(p.plan_.room, p.opening_ns_)) p.fault("is sent away from its room: " + e.detail);
    }
    // A resume too soon after the last one is refused so, which is no fault of the client.
    const bool is_early = e.reason == GoodbyeReason::over_rate && p.broken_ns_ >= 0;
    if (is_early) p.journal_->count("resumed too early");
    if (e.reason != GoodbyeReason::none && e.reason != GoodbyeReason::server_full && !is_early) p.broken_ns_ = -1;
    if (e.reason == GoodbyeReason::protocol_error) p.fault("lost for a protocol error: " + e.detail);
    if (e.reason == GoodbyeReason::over_rate && !is_early) p.fault("sends too much, says the server: " + e.detail);
    if (p.plan_.steady && (e.reason == GoodbyeReason::slow_consumer || e.reason == GoodbyeReason::idle_timeout))
      p.fault("is steady, and was sent away: " + e.detail);
  }
  void operator()(const link::Disconnected& e) const {
    p.journal_->mix(static_cast<std::uint64_t>(e.reason));
    p.journal_->count("ended, " + std::string(wire::to_string(e.reason)));
    const bool was_welcome = p.core_->welcome().has_value();
    const bool is_removed = p.plan_.may_be_removed && e.reason == GoodbyeReason::removed;
    if (!p.leaving_ && was_welcome && !is_removed) p.fault("ended: " + e.detail);
    p.has_session_ = false;
    p.haired_.clear();
    if (!was_welcome && (e.reason == GoodbyeReason::protocol_error || e.reason == GoodbyeReason::token_refused ||
                         e.reason == GoodbyeReason::version_unsupported || e.reason == GoodbyeReason::over_rate))
      p.fault("was not let in: " + e.detail);
  }
  void operator()(const wire::GroomStatus& e) const {
    p.journal_->mix(static_cast<std::uint64_t>(e.state));
    if (e.state == wire::GroomState::refused) p.fault("has its groom refused");
    if (e.state != wire::GroomState::ready || p.groom_wanted_ns_ < 0 || e.hash != p.first_groom()) return;
    const std::int64_t wait_ns = p.timeline_->now_ns() - std::exchange(p.groom_wanted_ns_, -1);
    if (p.plan_.steady && wait_ns > p.plan_.groom_wait_ns_max)
      p.fault("has waited " + std::to_string(wait_ns / kMs) + " ms for its groom");
  }
  void operator()(const wire::CharacterAdded& e) const {
    if (e.member == 0) p.fault("has a character that is no member");
    Player::Member member;
    member.key = server::character_key(static_cast<server::SessionId>(p.session()), e.character);
    member.groom = e.groom;
    member.own = true;
    for (const auto& [number, other] : p.members_) {
      if (other.key == member.key && number != e.member) p.fault("has a character twice");
    }
    p.members_[e.member] = member;
    p.journal_->mix(e.member);
  }
  void operator()(const wire::CharacterRemoved& e) const {
    p.journal_->mix(e.character);
    std::erase_if(p.members_,
                  [&](const auto& m) { return m.second.own && server::number_of(m.second.key) == e.character; });
    if (p.characters_.contains(e.character)) p.fault("loses a character that it has not removed");
  }
  void operator()(const wire::MemberJoined& e) const {
    if (e.session == p.session()) p.fault("gets its own character as another's");
    Player::Member member;
    member.key = server::character_key(static_cast<server::SessionId>(e.session), e.character);
    member.groom = e.groom;
    member.tag = e.tag;
    member.appearance = e.appearance;
    for (const auto& [number, other] : p.members_) {
      if (other.key == member.key && number != e.member) p.fault("gets another's character twice");
    }
    p.members_[e.member] = member;
    p.journal_->mix(e.member);
    if (p.observe_.mode == wire::ObserveMode::all && p.act_until_ns_ == 0) {
      const wire::MemberImportance seen{e.member, 0.5f, true};
      p.core_->report_importance({&seen, 1});
    }
  }
  void operator()(const wire::MemberChanged& e) const {
    const auto found = p.members_.find(e.member);
    if (found == p.members_.end()) return p.fault("learns that a member has changed which it does not know");
    Player::Member& member = found->second;
    if (member.own) p.fault("learns of its own change");
    if (member.tag == e.tag && member.appearance == e.appearance) p.fault("learns of a change to what it knows");
    member.tag = e.tag;
    member.appearance = e.appearance;
    p.journal_->mix(e.member);
    p.journal_->count("appearance changed");
  }
  void operator()(const wire::RoomWind& e) const {
    p.room_wind_ = e.wind;
    p.journal_->count("wind told");
  }
  void operator()(const wire::RoomProps& e) const {
    if (e.all) p.room_props_.clear();
    for (const wire::Prop& prop : e.props) {
      if (std::string error = wire::validate(prop); !error.empty()) p.fault("is told of a bad prop: " + error);
      p.room_props_.insert(prop.number);
    }
    for (const std::uint8_t number : e.removed) p.room_props_.erase(number);
    p.journal_->count("props told");
  }
  void operator()(const wire::MemberTouch& e) const {
    const auto found = p.members_.find(e.member);
    if (found == p.members_.end()) return p.fault("is told who may touch a member that it does not know");
    found->second.has_touch_rule = e.audience != TouchAudience::oneself;
    p.journal_->count("rule of touch told");
  }
  void operator()(const wire::Held& e) const {
    if (!p.plan_.touches) p.fault("is told of a hold, and has no hands");
    p.journal_->count(e.point_count > 0 ? "hair held" : "no hair held");
  }
  void operator()(const wire::RoomHands& e) const {
    for (const wire::RoomHands::Person& person : e.people) {
      if (person.session == p.session()) p.fault("is told of its own hands");
      if (std::string error = validate(person.hands); !error.empty()) p.fault("is told of bad hands: " + error);
      // A message may overtake another.
      auto& [tick, has_hands] = p.hands_of_others_[person.session];
      if (e.tick < tick) continue;
      tick = e.tick;
      has_hands = !person.hands.empty();
      p.journal_->count(has_hands ? "hands told" : "hands gone");
    }
  }
  void operator()(const wire::MemberLeft& e) const {
    p.journal_->mix(e.member);
    const auto found = p.members_.find(e.member);
    if (found == p.members_.end()) return;
    if (found->second.own) p.fault("gets its own character as left");
    p.members_.erase(found);
  }
  void operator()(const link::FrameBatch& e) const { p.check(e); }
  void operator()(const link::GroomFetched& e) const {
    p.journal_->mix(e.bytes ? e.bytes->size() : 0);
    p.journal_->count("groom fetched");
    if (!e.bytes) p.fault("fetched a groom in vain: " + e.error);
  }
  void operator()(const wire::Error& e) const {
    p.journal_->mix(static_cast<std::uint64_t>(e.reason));
    p.journal_->count("client got " + std::string(wire::to_string(e.reason)));
    if (e.reason == ErrorReason::none || e.detail.empty()) p.fault("is refused without a reason");
    const bool expected = e.reason == ErrorReason::groom_unavailable ||
                          (e.reason == ErrorReason::pose_invalid && p.plan_.sends_garbage) ||
                          (p.plan_.touches && is_of_touch(e.reason)) ||
                          (e.reason == ErrorReason::not_allowed && p.plan_.may_be_removed);
    if (!expected) p.fault("is refused (" + std::string(wire::to_string(e.reason)) + "): " + e.detail);
  }
};

void Player::hear() {
  for (link::Event& event : core_->take_events()) {
    journal_->mix(event.index());
    std::visit(EventHandler{*this}, event);
  }
  check_counters();
}

void Player::check_counters() {
  const link::LinkCounters counters = core_->counters();
  if (counters.frames_undecodable > counted_undecodable_) fault("cannot decode a frame");
  const std::uint64_t unknown = counters.frames_unknown - counted_unknown_;
  if (unknown > 0) {
    if (!has_datagrams()) fault("gets a frame of no member, or not newer than the last");
    journal_->count("frames overtaken", unknown);
  }
  if (counters.frames_lacking_learnt > 0) fault("is to evaluate hair and lacks its network");
  journal_->count("frames evaluated", counters.frames_evaluated - counted_evaluated_);
  counted_evaluated_ = counters.frames_evaluated;
  counted_undecodable_ = counters.frames_undecodable;
  counted_unknown_ = counters.frames_unknown;
}

void Player::check(const link::FrameBatch& batch) {
  journal_->mix(batch.tick);
  std::uint32_t last = 0;
  for (const link::Frame& frame : batch.frames) {
    if (frame.member <= last) fault("gets members out of order");
    last = frame.member;
    const auto found = members_.find(frame.member);
    if (found == members_.end()) {
      fault("gets a frame of member " + std::to_string(frame.member) + ", which it does not know");
      continue;
    }
    check(batch, frame, found->second);
  }
}

void Player::check(const link::FrameBatch& batch, const link::Frame& frame, Member& member) {
  const std::string what = "member " + std::to_string(frame.member) + " at tick " + std::to_string(batch.tick) + ": ";
  for (const float c : frame.coefficients) journal_->mix(std::bit_cast<std::uint32_t>(c));
  journal_->mix(static_cast<std::uint64_t>(std::llround(1e4 * frame.pose.head().position.x())));
  if (wire::validate_pose(frame.pose) != wire::PoseRefusal::none) fault(what + "its pose is not valid");
  // A frame that waited for its basis is repeated at the same tick.
  if (member.last_tick && batch.tick <= *member.last_tick && !(frame.repeated && batch.tick == *member.last_tick))
    fault(what + "ticks do not rise");
  if (member.own != (frame.character != 0)) fault(what + "is not whose it was");
  // Last known hair stands for a lattice that the new server does not have yet.
  const LevelIndex level = frame.last_known ? LevelIndex::rigid : frame.level;
  // The frame may have overtaken what it needs.
  const bool lacks_basis = frame.last_known && has_datagrams();
  if (frame.last_known) journal_->count("frames of kept hair");
  if (frame.last_known && !member.own) fault(what + "has kept hair, and is another's");
  const int life = connection_ ? connection_->life() : host_->life();
  const GroundTruth* truth = host_->truth(life, batch.tick, member.key);
  if (!truth) {
    fault(what + "was not in the World");
  } else {
    if (truth->level != level && !lacks_basis) fault(what + "is on another level than in the World");
    if (truth->asleep != frame.asleep && !frame.discontinuous) fault(what + "sleeps here or in the World, not in both");
    for (std::size_t b = 0; b < kBoneCount; ++b) {
      if (truth->pose.bones[b].position != frame.pose.bones[b].position ||
          truth->pose.bones[b].rotation.coeffs() != frame.pose.bones[b].rotation.coeffs()) {
        fault(what + "has another pose than in the World");
        break;
      }
    }
    check_hair(batch, frame, *truth, member);
  }
  // A character may wake and sleep again out of a client's view, or in frames that are lost. Only a client that gets
  // all frames can find fault with a second frame that says so.
  const bool saw_all =
      !has_datagrams() && !frame.repeated && calm_since_ns_ > 0 && member.last_ns > calm_since_ns_ + kSecond_ns;
  if (frame.asleep && member.asleep && saw_all && host_->metrics(life).tick.observers_congested.value() == 0)
    fault(what + "says twice that it sleeps");
  check_interval(batch, frame, member);
  if (frame.character != 0 && haired_.erase(frame.character) != 0 && !frame.basis && wants_hair(frame.character))
    fault(what + "has lost its hair on the way to another server");
  member.hair = frame.basis != nullptr && wants_hair(frame.character);
  member.last_tick = batch.tick;
  member.last_ns = timeline_->now_ns();
  member.asleep = frame.asleep;
  member.level = level;
  member.pose = frame.pose;
  ++member.frames;
}

// Compares the hair of a frame with that of the World. On the learnt level, and while that fades, hair may differ for
// some time: a network that has missed frames begins again, and the server must learn of it.
void Player::check_hair(const link::FrameBatch& batch, const link::Frame& frame, const GroundTruth& truth,
                        Member& member) {
  // Hair counts as learnt for kFade_ns after the last learnt frame, since it fades to another level meanwhile. kCalm_ns
  // after the last disturbance all frames have the error that clients ask for by default. Learnt hair, which client and
  // server compute in float, may differ by kLearntApart_m beside the error of its coding.
  constexpr std::int64_t kFade_ns = kSecond_ns;
  constexpr std::int64_t kCalm_ns = 4 * kSecond_ns;
  constexpr float kLearntApart_m = 8e-3f;
  const std::int64_t now_ns = timeline_->now_ns();
  const std::int64_t sampled_ns = batch.sample_time_ns;
  if (frame.level == LevelIndex::learnt) member.learnt_ns = sampled_ns;
  const bool is_learnt =
      member.learnt_ns && sampled_ns >= *member.learnt_ns && sampled_ns < *member.learnt_ns + kFade_ns;
  const bool is_shown = frame.level != LevelIndex::rigid && frame.basis && !frame.last_known;
  const int life = connection_ ? connection_->life() : host_->life();
  const int octaves = host_->coarser_octaves(life, batch.tick, static_cast<server::SessionId>(session()));
  const float apart_m = apart(frame.coefficients, truth.coefficients);
  // After the disturbances every head is half as high as the screen, and clients ask for the usual error.
  const bool is_usual = calm_since_ns_ > 0 && now_ns > calm_since_ns_ + kCalm_ns;
  const float coded_m =
      is_usual && is_learnt ? std::ldexp(2 * wire::Observe{}.error_m, octaves) : max_apart(coarsest_m_, octaves);
  const float max_m = coded_m + (is_learnt ? kLearntApart_m : 0);
  const bool is_like = !is_shown || apart_m <= max_m;
  if (is_like || member.frames == 0) member.off_since_ns.reset();
  if (is_like) return;
  const std::string what = "member " + std::to_string(frame.member) + " at tick " + std::to_string(batch.tick);
  if (!is_learnt) return fault(what + ": has other hair than in the World");
  journal_->count("frames of learnt hair that is off");
  // The time counts from the first frame that is off, because a client cannot report it earlier, and a poor line may
  // have brought nothing for seconds before.
  if (!member.off_since_ns) member.off_since_ns = now_ns;
  const NetworkQuality& quality = plan_.quality;
  const std::int64_t trip_ns = 2 * (quality.delay_ns + quality.jitter_ns);
  // The client's message may wait behind a groom, or get lost.
  const std::int64_t off_ns_max = quality.lossy || !plan_.steady ? 6 * kSecond_ns : kSecond_ns + trip_ns;
  const std::int64_t off_ns = now_ns - *member.off_since_ns;
  if (off_ns > off_ns_max)
    fault(what + ": has had other hair than in the World for " + std::to_string(off_ns / kMs) + " ms, which is " +
          std::to_string(1e3 * apart_m) + " mm off");
}

// Checks that a steady client misses no step of its own first character, and that each frame arrives soon after its
// tick.
void Player::check_interval(const link::FrameBatch& batch, const link::Frame& frame, const Member& member) {
  if (!plan_.steady || frame.character != 1 || member.frames == 0 || !connection_) return;
  const int life = connection_->life();
  for (std::uint64_t tick = *member.last_tick + 1; tick < batch.tick; ++tick) {
    const GroundTruth* truth = host_->truth(life, tick, member.key);
    if (truth && truth->stepped && !truth->asleep)
      fault("misses the step of its own at tick " + std::to_string(tick) + " before " + std::to_string(batch.tick));
  }
  const std::int64_t late_ns = timeline_->now_ns() - host_->ran_ns(life, batch.tick);
  if (late_ns > 2 * (plan_.quality.delay_ns + plan_.quality.jitter_ns) + kFrameLateness_ns)
    fault("has the frame of tick " + std::to_string(batch.tick) + " after " + std::to_string(late_ns / kMs) + " ms");
}

}  // namespace hairnet::whole
