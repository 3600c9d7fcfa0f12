#include "client/room/room.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "core/assert.hpp"
#include "core/shown_text.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::room {
namespace {

// The owner of a groom may still be uploading it. The room asks again after this time; more often would cost messages
// and bring nothing.
constexpr std::int64_t kAskAgain_ns = 3'000'000'000;
// A head outside of the view counts as one of this share of its size, so its groom is fetched after almost all grooms
// that are seen.
constexpr float kUnseenShare = 0.01f;

}  // namespace

Room::Room(std::unique_ptr<link::Conversation> conversation, const wire::Observe& observe)
    : conversation_(std::move(conversation)),
      observes_others_(observe.mode != wire::ObserveMode::list || !observe.members.empty()) {
  HAIRNET_ASSERT(conversation_);
  // This is the first request: a server would otherwise begin with frames of everybody.
  conversation_->send(observe);
}

void Room::advance() {
  const std::int64_t now_ns = conversation_->now_ns();
  for (const link::Event& event : conversation_->poll()) {
    // Events after close() are ignored: the caller has left the room.
    if (state_ != State::closed) std::visit([this](const auto& e) { take(e); }, event);
  }
  // The events above were read after a pause of unknown length. So Arrivals judges them by the time of the previous
  // call, and learns of this one only now.
  arrivals_.on_awake(now_ns);
  fetch(now_ns);
  for (const auto& [number, member] : members_) sample(*member, now_ns);
  play_hands(now_ns);
}

std::vector<Event> Room::take_events() {
  std::vector<Event> taken(std::make_move_iterator(events_.begin()), std::make_move_iterator(events_.end()));
  events_.clear();
  return taken;
}

void Room::tell(Event event) {
  // A caller that never takes events must not fill the memory.
  constexpr std::size_t kEventsMax = 10'000;
  if (events_.size() == kEventsMax) events_.pop_front();
  events_.push_back(std::move(event));
}

void Room::sample(Member& member, std::int64_t now_ns) {
  member.sample = member.playout.sample(now_ns);
  // A skin that is here stays, also while a reconnect has none: hair must not sink into the body meanwhile.
  if (std::shared_ptr<const Skin> skin = conversation_->skin_of(member.groom_hash)) member.skin = std::move(skin);
  const std::optional<Pose> played = member.sample.valid ? std::optional(member.sample.pose) : std::nullopt;
  // An own head is shown at its newest pose, without the delay of play-out, since people notice a head that lags behind
  // their own.
  const auto own = own_.find(member.own);
  member.pose = own != own_.end() && own->second.pose ? own->second.pose : played;
}

std::shared_ptr<const Member> Room::member_of(std::uint32_t own) const {
  const auto found = own_.find(own);
  return found != own_.end() && found->second.is_here ? found->second.member : nullptr;
}

wire::GroomHash Room::groom_of(std::uint32_t own) const {
  const auto found = own_.find(own);
  return found == own_.end() ? wire::GroomHash{} : found->second.groom;
}

Result<std::uint32_t> Room::add_character(link::RequestedState::Bytes groom_file, CharacterOptions options,
                                          std::shared_ptr<const Groom> decoded) {
  HAIRNET_ASSERT(groom_file);
  if (std::string error = wire::validate_tag(options.tag); !error.empty()) return dropped(std::move(error));
  const wire::GroomHash hash = wire::hash_groom(*groom_file);
  const auto known = grooms_.find(hash);
  const bool is_known = known != grooms_.end() && known->second.groom;
  if (!is_known && !decoded) {
    // The file is decoded here although the server validates it too: the caller learns at once what is wrong, and the
    // own head can be shown before any download.
    Result<Groom> groom = wire::decode_groom(*groom_file);
    if (!groom) return Refusal(std::move(groom.error()));
    decoded = std::make_shared<const Groom>(std::move(*groom));
  }
  KnownGroom& kept = grooms_[hash];
  // A groom whose download has failed is replaced by the caller's own.
  if (!is_known) kept = {std::move(decoded), nullptr, "", {}};
  kept.file = std::move(groom_file);
  // The room may have been waiting for a download of the same groom, which is not needed any more.
  queue_.remove(hash);
  // Members with the same hair need no download any more.
  give_groom(hash);
  return add(hash, std::move(options));
}

Result<std::uint32_t> Room::add_character(const std::shared_ptr<const Groom>& groom, CharacterOptions options,
                                          const LearntHair* learnt) {
  HAIRNET_ASSERT(groom);
  return add_character(std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(*groom, learnt)),
                       std::move(options));
}

Result<std::uint32_t> Room::add_character_like(const Member& member, CharacterOptions options) {
  if (std::string error = wire::validate_tag(options.tag); !error.empty()) return dropped(std::move(error));
  return add(member.groom_hash, std::move(options));
}

std::uint32_t Room::add(const wire::GroomHash& groom, CharacterOptions&& options) {
  const std::uint32_t number = next_own_++;
  Own& own = own_[number];
  // CharacterAdded brings the number alone, so the rest is kept here.
  own.groom = groom;
  own.tag = options.tag;
  own.appearance = options.appearance;
  if (const auto known = grooms_.find(groom); known != grooms_.end() && known->second.file)
    // The offer goes before the character: the server refuses a character of a groom that it does not know.
    conversation_->offer_groom(groom, known->second.file);
  conversation_->send(wire::AddCharacter{number, groom, options.level, {}, std::move(options.tag), options.appearance});
  return number;
}

void Room::remove_character(std::uint32_t own) {
  const auto found = own_.find(own);
  if (found == own_.end()) return;
  const Own removed = std::move(found->second);
  // The entry goes before drop(), which would otherwise only mark it. The server's CharacterRemoved then finds nothing
  // to do.
  own_.erase(found);
  conversation_->send(wire::RemoveCharacter{own});
  if (removed.is_here) drop(removed.member->number);
  forget_unused(removed.groom);
}

void Room::set_level(std::uint32_t own, LevelIndex level) {
  if (own_.contains(own)) conversation_->send(wire::SetLevel{own, level});
}

Result<void> Room::set_material(std::uint32_t own, const MaterialScale& scale) {
  if (std::string error = validate(scale); !error.empty()) return dropped(std::move(error));
  if (own_.contains(own)) conversation_->send(wire::SetMaterial{own, scale});
  return {};
}

Result<void> Room::set_appearance(std::uint32_t own, std::string tag, std::optional<wire::Appearance> appearance) {
  if (std::string error = wire::validate_tag(tag); !error.empty()) return dropped(std::move(error));
  const auto found = own_.find(own);
  if (found == own_.end()) return {};
  Own& changed = found->second;
  changed.tag = tag;
  changed.appearance = appearance;
  conversation_->send(wire::SetAppearance{own, std::move(tag), appearance});
  if (!changed.member) return {};
  // The server tells a change to others alone, so the own member changes here.
  changed.member->tag = changed.tag;
  changed.member->appearance = changed.appearance;
  if (changed.is_here) tell(Changed{changed.member->number, changed.member});
  return {};
}

Result<void> Room::push(std::span<const OwnPose> poses) {
  Result<void> result;
  std::vector<wire::PoseSample> samples;
  const std::int64_t now_ns = conversation_->now_ns();
  for (const OwnPose& each : poses) {
    const auto found = own_.find(each.own);
    if (found == own_.end()) continue;
    // Both the pose and its rounding must be valid, since the server sees the rounded one.
    wire::PoseRefusal refusal = wire::validate_pose(each.pose);
    if (refusal == wire::PoseRefusal::none) refusal = wire::validate_pose(rounded_to_wire(each.pose));
    if (refusal != wire::PoseRefusal::none) {
      std::string error = "character " + std::to_string(each.own) + ": " + std::string(wire::to_string(refusal));
      // The first error is returned, and the valid poses are sent.
      if (Refusal refused = dropped(std::move(error)); result) result = std::move(refused);
      continue;
    }
    found->second.pose = each.pose;
    // The time of capture is that of this call. The sequence also rises over reconnects, so that a late datagram never
    // replaces a newer pose.
    samples.push_back({each.own, ++found->second.sequence, now_ns, each.teleport, each.pose});
  }
  if (!samples.empty()) conversation_->push_poses(std::move(samples));
  return result;
}

Result<void> Room::push(std::uint32_t own, const Pose& pose, bool teleport) {
  const OwnPose one{own, pose, teleport};
  return push(std::span(&one, 1));
}

Result<void> Room::set_wind(const Wind& wind) {
  if (std::string error = validate(wind); !error.empty()) return dropped(std::move(error));
  conversation_->send(wire::SetWind{wind});
  return {};
}

// Counts each refused input, for programs that look at no results.
Refusal Room::dropped(std::string error) {
  ++inputs_dropped_;
  return Refusal(std::move(error));
}

void Room::report_importance(std::vector<wire::MemberImportance> members) {
  std::erase_if(members, [this](const wire::MemberImportance& each) {
    inputs_dropped_ += !std::isfinite(each.screen_height);
    return !std::isfinite(each.screen_height) || !members_.contains(each.member);
  });
  for (wire::MemberImportance& each : members)
    // A head close to the camera may have any height; the server would refuse the whole message.
    each.screen_height = std::clamp(each.screen_height, 0.0f, wire::kScreenHeightMax);
  std::vector<std::pair<wire::GroomHash, float>> heights;
  for (const wire::MemberImportance& each : members)
    heights.emplace_back(members_.at(each.member)->groom_hash, each.screen_height * (each.in_view ? 1 : kUnseenShare));
  queue_.set_heights(heights);
  if (!members.empty()) conversation_->report_importance(members);
}

void Room::fetch_first(std::optional<std::uint32_t> member, bool only_this) {
  first_ = member;
  fetches_only_first_ = only_this;
}

void Room::close() {
  if (state_ == State::closed) return;
  conversation_->close();
  // Each member leaves by an event of its own, so that a caller may rely on a Left for each Joined.
  while (!members_.empty()) drop(members_.begin()->first);
  set_state(State::closed, "");
}

void Room::set_state(State state, std::string detail, double wait_s, bool is_refused) {
  state_ = state;
  tell(StateChanged{state, std::move(detail), wait_s, is_refused});
}

// Rights and touch rules are those of this connection: another server may have other settings.
void Room::take(const link::Connected& connected) {
  session_ = connected.welcome.session;
  may_set_wind_ = connected.welcome.may_set_wind;
  may_touch_ = connected.welcome.may_touch;
  may_set_props_ = connected.welcome.may_set_props;
  forget_touch();
  for (auto& [number, own] : own_) {
    // Another server gives the numbers of sessions to other people, so the link forgets them too
    // (RequestedState::forget_sessions).
    if (connected.again && !connected.welcome.resumed) own.touch_chosen.clear();
    if (!own.member) continue;
    // A new session has another number, by which others know this client.
    own.member->session = session_;
    set_touch(*own.member, own.touch, own.touch_chosen);
  }
  set_state(State::connected, "");
}

void Room::take(const link::Reconnecting& lost) {
  // Without frames hair would ease to rest. It is frozen, because most outages are short and the hair goes on from
  // there.
  for (const auto& [number, member] : members_) member->playout.freeze();
  set_state(State::reconnecting, lost.detail.empty() ? "the connection broke" : lost.detail, lost.wait_s);
}

void Room::take(const link::Disconnected& end) {
  while (!members_.empty()) drop(members_.begin()->first);
  set_state(State::closed, end.detail, 0, link::is_final(end.reason));
}

void Room::take(const wire::MemberJoined& joined) {
  auto member = std::make_shared<Member>();
  member->number = joined.member;
  member->session = joined.session;
  member->owners_character = joined.character;
  member->groom_hash = joined.groom;
  member->tag = joined.tag;
  member->appearance = joined.appearance;
  meet(member);
}

void Room::take(const wire::MemberChanged& changed) {
  const auto found = members_.find(changed.member);
  if (found == members_.end()) return;
  found->second->tag = changed.tag;
  found->second->appearance = changed.appearance;
  tell(Changed{changed.member, found->second});
}

// A new server gives the character another member number, which may have belonged to another own character. The Member
// object stays the same, so its hair continues.
void Room::take(const wire::CharacterAdded& added) {
  const auto found = own_.find(added.character);
  if (found == own_.end()) return;
  Own& own = found->second;
  // The server announces own characters again after a resume.
  if (own.is_here && own.member->number == added.member) return;
  if (own.is_here) drop(own.member->number);
  if (!own.member) own.member = std::make_shared<Member>();
  own.member->number = added.member;
  own.member->own = own.member->owners_character = added.character;
  own.member->session = session_;
  own.member->groom_hash = own.groom;
  own.member->tag = own.tag;
  own.member->appearance = own.appearance;
  own.member->touch = own.touch;
  own.member->touch_chosen = own.touch_chosen;
  meet(own.member);
  own.is_here = true;
}

void Room::take(const wire::CharacterRemoved& removed) {
  const auto found = own_.find(removed.character);
  if (found != own_.end() && found->second.is_here) drop(found->second.member->number);
}

void Room::take(const wire::RoomWind& wind) {
  wind_ = wind.wind;
  tell(WindChanged{wind.wind, wind.session});
}

void Room::take(const wire::GroomStatus& status) {
  // The reason comes in an Error of its own.
  if (status.state == wire::GroomState::refused)
    tell(Error{"the server refuses a groom", wire::ErrorReason::none, 0, status.hash});
}

void Room::take(const link::FrameBatch& batch) {
  const std::int64_t sampled_ns = conversation_->to_local_ns(batch.sample_time_ns);
  const std::int64_t arrival_ns = arrivals_.time_of(sampled_ns, batch.received_ns);
  if (observer_) observer_->on_batch(batch, sampled_ns, batch.received_ns);
  for (const link::Frame& frame : batch.frames) {
    const auto found = members_.find(frame.member);
    if (found == members_.end()) continue;
    found->second->playout.push(frame, sampled_ns, arrival_ns);
    if (observer_) observer_->on_frame(batch, frame, *found->second);
  }
}

void Room::take(const wire::Error& error) {
  const bool names_groom = error.groom != wire::GroomHash{};
  // Whatever the error is, this download has ended and the next one may begin.
  if (names_groom) queue_.finish(error.groom);
  const bool may_come_later =
      error.reason == wire::ErrorReason::groom_unavailable || error.reason == wire::ErrorReason::limit_exceeded;
  // This is no error for people yet: the groom's owner may still be sending it.
  if (may_come_later && names_groom) {
    const auto known = grooms_.find(error.groom);
    if (known != grooms_.end() && !known->second.groom) {
      known->second.ask_again_ns = conversation_->now_ns() + kAskAgain_ns;
      return;
    }
  }
  // A new server could not continue the hair, which starts at rest. A person need not know this.
  if (error.reason == wire::ErrorReason::state_invalid) return;
  std::string line = std::string("the server refuses: ") + wire::to_string(error.reason);
  if (error.character != 0) line += ", character " + std::to_string(error.character);
  if (!error.detail.empty()) line += " (" + error.detail + ")";
  tell(Error{std::move(line), error.reason, error.character, error.groom});
}

// A member enters the room: it gets the groom that is known, or its groom is queued.
void Room::meet(const std::shared_ptr<Member>& member) {
  // A number belongs to one member at a time; a MemberLeft that was lost with a connection is made up for here.
  drop(member->number);
  members_[member->number] = member;
  shown_[member->number] = member;
  const auto [known, is_new] = grooms_.try_emplace(member->groom_hash);
  member->groom = known->second.groom;
  member->groom_file = known->second.file;
  // An earlier member may have brought the groom, or its error.
  member->error = known->second.error;
  // A program that shows only its own heads has their files already.
  if (is_new && observes_others_) queue_.add(member->groom_hash);
  tell(Joined{member->number, member});
}

// Removes the member of that number from the room, if there is one.
void Room::drop(std::uint32_t number) {
  const auto found = members_.find(number);
  if (found == members_.end()) return;
  // The copy keeps the member alive for its Left event, whose reader may still want its tag.
  const std::shared_ptr<Member> member = found->second;
  members_.erase(found);
  shown_.erase(number);
  const auto own = own_.find(member->own);
  if (own != own_.end()) own->second.is_here = false;
  forget_unused(member->groom_hash);
  tell(Left{number, member});
}

bool Room::is_used(const wire::GroomHash& groom) const {
  return std::ranges::any_of(members_, [&](const auto& each) { return each.second->groom_hash == groom; }) ||
         std::ranges::any_of(own_, [&](const auto& each) { return each.second.groom == groom; });
}

void Room::forget_unused(const wire::GroomHash& groom) {
  // A groom goes with the last that uses it, so a room through which many people pass does not grow.
  if (is_used(groom)) return;
  grooms_.erase(groom);
  queue_.remove(groom);
}

// Gives the groom to all members that have it.
void Room::give_groom(const wire::GroomHash& hash) {
  const KnownGroom& known = grooms_.at(hash);
  for (const auto& [number, member] : members_) {
    if (member->groom_hash != hash) continue;
    member->groom = known.groom;
    member->groom_file = known.file;
    member->error = known.error;
  }
}

void Room::take(const link::GroomFetched& fetched) {
  queue_.finish(fetched.hash);
  const auto found = grooms_.find(fetched.hash);
  // Its members may have left, or an own character may have added the same file.
  if (found == grooms_.end() || found->second.groom) return;
  KnownGroom& known = found->second;
  known.error = fetched.error;
  if (fetched.bytes) {
    Result<Groom> groom = wire::decode_groom(*fetched.bytes);
    known.error = groom ? "" : groom.error();
    if (groom) known.groom = std::make_shared<const Groom>(std::move(*groom));
    if (groom) known.file = fetched.bytes;
  }
  give_groom(fetched.hash);
  if (!known.error.empty())
    tell(Error{"a hairstyle cannot be shown: " + known.error, wire::ErrorReason::groom_invalid, 0, fetched.hash});
}

void Room::fetch(std::int64_t now_ns) {
  for (auto& [hash, known] : grooms_) {
    if (!known.ask_again_ns || now_ns < *known.ask_again_ns) continue;
    // The request is repeated once each time that the server says no.
    known.ask_again_ns.reset();
    if (!known.groom) queue_.add(hash);
  }
  std::optional<wire::GroomHash> first;
  if (const auto member = members_.find(first_.value_or(0)); first_ && member != members_.end())
    first = member->second->groom_hash;
  if (const auto wanted = queue_.next(now_ns, first, fetches_only_first_)) conversation_->request_groom(*wanted);
}

std::string describe(const Event& event) {
  struct Describe {
    std::string operator()(const StateChanged& e) const {
      switch (e.state) {
        case State::connecting:
          return "connecting";
        case State::connected:
          return "connected";
        case State::reconnecting:
          return "reconnecting: " + e.detail;
        case State::closed:
          return "closed: " + e.detail;
      }
      return "";
    }
    std::string operator()(const Joined& e) const { return named(e.number, *e.member) + " has joined"; }
    std::string operator()(const Left& e) const { return named(e.number, *e.member) + " has left"; }
    std::string operator()(const Changed& e) const { return named(e.number, *e.member) + " has changed"; }
    std::string operator()(const WindChanged& e) const {
      return "the wind is " + std::to_string(e.wind.mean_m_per_s.norm()) + " m/s";
    }
    std::string operator()(const HeldChanged& e) const {
      return "hand " + std::to_string(e.hand) + " holds " + std::to_string(e.point_count) + " points of member " +
             std::to_string(e.member);
    }
    std::string operator()(const PropsChanged&) const { return "the props have changed"; }
    std::string operator()(const TouchChanged& e) const {
      return "another audience may touch the hair of member " + std::to_string(e.number);
    }
    std::string operator()(const Error& e) const { return e.detail; }
    static std::string named(std::uint32_t number, const Member& member) {
      const std::string name = "member " + std::to_string(number);
      return member.tag.empty() ? name : name + " '" + shown_text(member.tag, wire::kTagBytesMax, '\'') + "'";
    }
  };
  return std::visit(Describe{}, event);
}

}  // namespace hairnet::room
