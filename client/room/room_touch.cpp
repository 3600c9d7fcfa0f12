#include "client/room/room_touch.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "client/room/room.hpp"

namespace hairnet::room {
namespace {

// 32 samples are half a second at 60 Hz. Hair is played out with a shorter delay, so older samples are never shown.
constexpr std::size_t kSamplesMax = 32;
constexpr const char* kNotConnected = "the room is not connected: nothing is held, released or set";

}  // namespace

void RoomTouch::take(const wire::RoomProps& announced) {
  // A full list replaces what is known, as after a reconnect to another server.
  if (announced.all) props_.clear();
  for (const std::uint8_t number : announced.removed) props_.erase(number);
  for (const wire::Prop& prop : announced.props) props_.insert_or_assign(prop.number, prop);
}

void RoomTouch::take(const wire::RoomHands& announced, std::int64_t sampled_ns, std::int64_t now_ns) {
  for (const auto& [session, hands] : announced.people) {
    auto person = std::ranges::find(people_, session, &Person::session);
    if (person == people_.end()) person = people_.insert(person, Person{session, now_ns, {}});
    std::vector<Sample>& samples = person->samples;
    // Datagrams may overtake one another: an older sample would move the hand back.
    if (!samples.empty() && announced.tick <= samples.back().tick) continue;
    if (samples.size() == kSamplesMax) samples.erase(samples.begin());
    samples.push_back({announced.tick, sampled_ns, hands});
    person->heard_ns = now_ns;
  }
}

void RoomTouch::play_hands(std::optional<std::int64_t> sampled_ns, std::int64_t now_ns) {
  std::erase_if(people_, [&](const Person& person) { return now_ns - person.heard_ns > kHandsGone_ns; });
  hands_.clear();
  for (const auto& [session, heard_ns, samples] : people_) {
    // `next` is the first sample after the shown time, and `now` the one before it. Without a shown time, `now` is the
    // newest sample.
    auto next = sampled_ns ? samples.begin() : samples.end();
    while (next != samples.end() && next->sampled_ns <= *sampled_ns) ++next;
    // The shown hair is older than all samples of this person, so these hands are not shown yet.
    if (next == samples.begin()) continue;
    const Sample& now = *std::prev(next);
    if (now.hands.empty()) continue;
    std::vector<Hand>& hands = hands_.emplace_back(wire::RoomHands::Person{session, now.hands}).hands;
    // No newer sample has come: the hand stays at the last one, since a guessed motion would have to be taken back.
    if (next == samples.end()) continue;
    // Hands are interpolated linearly between two samples, as poses are, so that a hand and the hair that it moves stay
    // together.
    const double share =
        static_cast<double>(*sampled_ns - now.sampled_ns) / static_cast<double>(next->sampled_ns - now.sampled_ns);
    move_towards(next->hands, share, hands);
  }
}

void RoomTouch::clear() {
  props_.clear();
  people_.clear();
  hands_.clear();
}

bool Room::may_touch(const Member& member) const {
  // A mute, or a token without the right to touch, concerns only hair of others.
  if (member.own != 0) return member.touch != TouchAudience::nobody;
  const bool is_chosen = member.touch == TouchAudience::chosen && std::ranges::count(member.touch_chosen, session_) > 0;
  return may_touch_ && (member.touch == TouchAudience::everyone || is_chosen);
}

Result<void> Room::set_touch(std::uint32_t own, TouchAudience audience, std::vector<std::uint64_t> chosen) {
  if (chosen.size() > wire::kTouchChosenMax)
    return dropped("touch: more than " + std::to_string(wire::kTouchChosenMax) + " are chosen");
  const auto found = own_.find(own);
  if (found == own_.end()) return {};
  Own& changed = found->second;
  changed.touch = audience;
  changed.touch_chosen = chosen;
  conversation_->send(wire::SetTouch{own, audience, chosen});
  if (changed.member) set_touch(*changed.member, audience, std::move(chosen));
  return {};
}

Result<void> Room::push_hands(std::span<const Hand> hands) {
  std::vector<Hand> all(hands.begin(), hands.end());
  if (std::string error = validate(all); !error.empty()) return dropped(std::move(error));
  conversation_->push_hands(std::move(all));
  return {};
}

Result<void> Room::take_hold(std::uint32_t member, std::uint8_t hand, const Vec3f& place, float radius_m) {
  const wire::TakeHold hold{member, hand, place, radius_m};
  if (std::string error = wire::validate(hold); !error.empty()) return dropped(std::move(error));
  // A hold that waited for a reconnect would take hold of hair that has moved meanwhile.
  if (state_ != State::connected) return dropped(kNotConnected);
  if (!members_.contains(member)) return dropped("hold: there is no member " + std::to_string(member));
  conversation_->send(hold);
  return {};
}

Result<void> Room::let_go(std::uint32_t member, std::uint8_t hand, Release release) {
  if (state_ != State::connected) return dropped(kNotConnected);
  if (members_.contains(member)) conversation_->send(wire::LetGo{member, hand, release});
  return {};
}

Result<void> Room::set_props(std::vector<wire::Prop> props, std::vector<std::uint8_t> removed) {
  if (props.size() > wire::kPropsMax || removed.size() > wire::kPropsMax)
    return dropped("props: more than " + std::to_string(wire::kPropsMax));
  for (wire::Prop& prop : props) {
    // The server would refuse the whole message; here the error names the prop.
    if (const std::string error = wire::validate(prop); !error.empty())
      return dropped("prop " + std::to_string(prop.number) + ": " + error);
    prop.place.rotation.normalize();
  }
  if (std::ranges::any_of(removed, [](std::uint8_t number) { return number >= wire::kPropsMax; }))
    return dropped("props: a removed number is not below " + std::to_string(wire::kPropsMax));
  if (state_ != State::connected) return dropped(kNotConnected);
  conversation_->send(wire::SetProps{std::move(props), std::move(removed)});
  return {};
}

// After a welcome the server announces all props again, and all touch rules that differ from the default.
void Room::forget_touch() {
  // The event is only sent if something changes for the caller.
  const bool had_props = !touch_.props().empty();
  touch_.clear();
  if (had_props) tell(PropsChanged{});
  for (const auto& [number, member] : members_) {
    if (member->own == 0) set_touch(*member, TouchAudience::oneself, {});
  }
}

void Room::set_touch(Member& member, TouchAudience audience, std::vector<std::uint64_t> chosen) {
  if (member.touch == audience && member.touch_chosen == chosen) return;
  member.touch = audience;
  member.touch_chosen = std::move(chosen);
  if (members_.contains(member.number)) tell(TouchChanged{member.number});
}

void Room::take(const wire::RoomProps& announced) {
  touch_.take(announced);
  tell(PropsChanged{});
}

void Room::take(const wire::MemberTouch& announced) {
  const auto found = members_.find(announced.member);
  // The rule of an own character is the one that this client has set last: the announcement may answer an earlier rule.
  if (found != members_.end() && found->second->own == 0)
    set_touch(*found->second, announced.audience, announced.chosen);
}

void Room::take(const wire::Held& held) {
  if (members_.contains(held.member)) tell(HeldChanged{held.member, held.hand, held.point_count});
}

void Room::take(const wire::RoomHands& announced) {
  touch_.take(announced, conversation_->to_local_ns(announced.sample_time_ns), conversation_->now_ns());
}

// Each member is shown at a sample time of its own, because hair that the server steps more often has a shorter delay.
// Hands are shown at the newest of these times.
void Room::play_hands(std::int64_t now_ns) {
  std::optional<std::int64_t> shown_ns;
  for (const auto& [number, member] : members_) {
    if (member->sample.valid) shown_ns = std::max(shown_ns, std::optional(member->sample.time_ns));
  }
  touch_.play_hands(shown_ns, now_ns);
}

}  // namespace hairnet::room
