#include "server/tick/touch.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/assert.hpp"
#include "core/touch/hand.hpp"
#include "schema/codec/hand_code.hpp"

namespace hairnet::server {
namespace {

// Changes of one character's rule are announced at most this often in a second: the owner may change the rule all the
// time, and each announcement goes to the whole room.
constexpr std::uint32_t kRuleChangesPer_s = 4;
// A session gets hands that are at most this far from a head whose frames it gets. The longest hair is about as long,
// so hands farther away hardly touch hair that the session sees.
constexpr double kShownReach_m = 1.5;
// A session gets the hands of at most this many other people, so that a crowd does not fill its connection.
constexpr std::size_t kPeopleShownMax = 64;
// Upper bounds of the bytes of a packet of hands beside its people, and of each person beside the hands.
constexpr std::size_t kRoomHandsBytes = 128, kPersonBytes = 16;

bool is_same_place(const RigidTransform& a, const RigidTransform& b) {
  return a.position == b.position && a.rotation.coeffs() == b.rotation.coeffs();
}

// Compares places and shapes, and not has_jumped: a hand that jumps to where it is has not moved.
bool are_same(const std::vector<Hand>& a, const std::vector<Hand>& b) {
  return std::ranges::equal(a, b, [](const Hand& x, const Hand& y) {
    return x.first_number == y.first_number && x.shapes == y.shapes && is_same_place(x.place, y.place);
  });
}

// Makes the rule of a message. Its list is sorted and has no repeats, because may_touch() searches it, and equal rules
// must compare equal.
TouchRule rule_of(const wire::SetTouch& set) {
  TouchRule rule{set.audience, {}};
  if (set.audience != TouchAudience::chosen) return rule;
  for (const std::uint64_t session : set.chosen) {
    // A client may name any number; one that no session can have would mean another toucher when cut to its bits.
    if (session != kRoomToucher && std::in_range<ToucherId>(session))
      rule.chosen.push_back(static_cast<ToucherId>(session));
  }
  std::ranges::sort(rule.chosen);
  const auto again = std::ranges::unique(rule.chosen);
  rule.chosen.erase(again.begin(), again.end());
  return rule;
}

// How far the hand reaches from its own place.
double extent_m(const Hand& hand) {
  double extent_m = 0;
  for (const HandShape& shape : hand.shapes)
    extent_m = std::max(extent_m, std::max(shape.from.norm(), shape.to.norm()) + shape.radius_m);
  return extent_m;
}

// Owners may always touch their own hair. For others both the moderator and the owner's rule must allow it.
bool may_touch(const Observer& observer, const Character& character) {
  const SessionId owner = session_of(character.key);
  return (observer.may_touch_others || owner == observer.session) &&
         may_touch(character.touch_rule, owner, observer.session);
}

// Null when no character has the number.
const Character* find_member(const Room& room, std::uint32_t member) {
  return member == 0 || member > room.slots.size() ? nullptr : room.slots[member - 1].character;
}

// Applies the change, and notes which props the observers and the World must be told of.
void change_props(wire::SetProps change, RoomTouch& touch) {
  // A prop has jumped if it jumps and then moves in the same tick, or if it is set again in the tick in which it was
  // removed.
  const auto has_jumped = [&](const wire::Prop& prop) {
    const bool was_changed = touch.props_changed.contains(prop.number);
    const auto before = touch.props.find(prop.number);
    if (before == touch.props.end()) return was_changed;
    return (was_changed && before->second.has_jumped) || std::ranges::count(change.removed, prop.number) > 0;
  };
  for (wire::Prop& prop : change.props) prop.has_jumped = prop.has_jumped || has_jumped(prop);
  for (const std::uint8_t number : change.removed) {
    if (touch.props.contains(number)) touch.props_changed.insert(number);
  }
  for (const wire::Prop& prop : change.props) touch.props_changed.insert(prop.number);
  touch.had_props = touch.had_props || !change.props.empty();
  touch.is_changed = touch.is_changed || !touch.props_changed.empty();
  // An unqualified call would mean std::apply.
  server::apply(change, touch.props);
}

// All bodies of a room: its props and then the hands of its sessions. The hands of a session that may not touch others
// are marked `only_own`.
std::vector<TouchBody> bodies_of(const RoomTouch& touch) {
  std::vector<TouchBody> bodies;
  for (const auto& [number, prop] : touch.props)
    bodies.push_back({{kRoomToucher, number}, prop.shape, prop.place, prop.has_jumped});
  for (const Observer* observer : touch.touchers) {
    const std::size_t first = bodies.size();
    for (const Hand& hand : observer->hands) append_bodies(hand, observer->session, bodies);
    if (observer->may_touch_others) continue;
    for (std::size_t b = first; b < bodies.size(); ++b) bodies[b].only_own = true;
  }
  return bodies;
}

// Whether the session gets frames of a character in one of the slots.
bool sees_any(const Observer& observer, std::span<const std::uint32_t> slots) {
  return std::ranges::any_of(slots, [&](std::uint32_t slot) {
    if (slot >= observer.views.size() || !observer.knows(slot)) return false;
    return observer.views[slot].wanted && observer.views[slot].in_view;
  });
}

}  // namespace

wire::MemberTouch touch_message(const Character& character) {
  const TouchRule& rule = character.touch_rule;
  return {member_of(character), rule.audience, {rule.chosen.begin(), rule.chosen.end()}};
}

void Touch::begin_tick(SimulationInputs& inputs) {
  for (const SimulationInputs::LetGo& pin : late_pins_) holds_.erase({pin.character, pin.hand});
  inputs.releases = std::exchange(late_pins_, {});
}

void Touch::open(const std::vector<wire::Prop>& props, bool is_new, Observer& observer, std::int64_t now_ns) {
  Room& room = rooms_->room(observer.room);
  const bool is_alone = room.observers.size() == 1;
  // A room without other sessions begins with the props that come with this session, as after a change of server.
  if (is_new && is_alone && !(props.empty() && room.touch.props.empty())) {
    wire::SetProps replacement{props, {}};
    for (const auto& [number, prop] : room.touch.props) replacement.removed.push_back(number);
    change_props(std::move(replacement), room.touch);
  }
  observer.hands_shown.clear();
  if (!observer.sink || !room.touch.had_props) return;
  wire::RoomProps announced{{}, {}, true};
  for (const auto& [number, prop] : room.touch.props) announced.props.push_back(prop);
  observer.sink->push(std::move(announced), now_ns);
  // The only person in the room has just been told all of them.
  if (is_alone) room.touch.props_changed.clear();
}

void Touch::set_right(const SetTouchRight& right) {
  Observer* const observer = rooms_->observer(right.session);
  if (!observer || observer->may_touch_others == right.may_touch_others) return;
  observer->may_touch_others = right.may_touch_others;
  RoomTouch& touch = rooms_->room(observer->room).touch;
  touch.is_changed = touch.is_changed || !observer->hands.empty();
}

void Touch::set_rule(const wire::SetTouch& set, SessionId session) {
  Character* const character = rooms_->find(character_key(session, set.character));
  TouchRule rule = rule_of(set);
  if (!character || character->touch_rule == rule) return;
  character->touch_rule = std::move(rule);
  rules_changed_.insert(character->key);
  rules_unannounced_.insert(character->key);
}

void Touch::take_hold(const wire::TakeHold& take, SessionId session, std::int64_t now_ns, SimulationInputs& inputs) {
  const Observer* const observer = rooms_->observer(session);
  if (!observer) return;
  const Character* const character = find_member(rooms_->room(observer->room), take.member);
  if (!character) {
    counters_->holds_refused_unknown.add();
    return refuse(*observer, wire::ErrorReason::character_unknown,
                  "take_hold: the room has no member " + std::to_string(take.member), now_ns);
  }
  if (!may_touch(*observer, *character)) {
    counters_->holds_refused_not_allowed.add();
    return refuse(*observer, wire::ErrorReason::not_allowed,
                  "take_hold: this session may not touch the hair of member " + std::to_string(take.member), now_ns);
  }
  const TouchKey hand{session, take.hand};
  // A new hold of the same hand ends the earlier one, whose pin would otherwise take what the new one holds.
  std::erase_if(late_pins_, [&](const auto& pin) { return pin.character == character->key && pin.hand == hand; });
  // kGrabRadiusMax_m, rounded to the float of a message, may be above the limit itself.
  const double radius_m = std::min(static_cast<double>(take.radius_m), kGrabRadiusMax_m);
  inputs.grabs.push_back({character->key, {hand, take.place.cast<double>(), radius_m}});
}

void Touch::let_go(const wire::LetGo& let_go, SessionId session, std::int64_t now_ns, SimulationInputs& inputs) {
  const Observer* const observer = rooms_->observer(session);
  if (!observer) return;
  const Room& room = rooms_->room(observer->room);
  if (let_go.member == 0 || let_go.member > room.slots.size())
    return refuse(*observer, wire::ErrorReason::character_unknown,
                  "let_go: the room has no member " + std::to_string(let_go.member), now_ns);
  const Character* const character = find_member(room, let_go.member);
  // The member has left meanwhile, with its hair.
  if (!character) return;
  const Hold hold{character->key, {session, let_go.hand}};
  const SimulationInputs::LetGo release{hold.character, hold.hand, let_go.release};
  const auto is_of_hold = [&](const SimulationInputs::TakeHold& take) {
    return take.character == hold.character && take.grab.hand == hold.hand;
  };
  // The World releases before it grabs within a step, so a pin in the same tick would find nothing held.
  if (let_go.release == Release::pin && std::ranges::any_of(inputs.grabs, is_of_hold))
    return late_pins_.push_back(release);
  inputs.releases.push_back(release);
  if (let_go.release == Release::unpin) return;
  holds_.erase(hold);
  // A hold that was taken in this same tick ends before the step, so its session is told that the hand holds nothing.
  for (std::size_t taken = std::erase_if(inputs.grabs, is_of_hold); taken > 0; --taken) tell_held(hold, 0, now_ns);
}

void Touch::set_props(const wire::SetProps& set, SessionId session) {
  const Observer* const observer = rooms_->observer(session);
  if (observer) change_props(set, rooms_->room(observer->room).touch);
}

void Touch::tell_rules(std::uint64_t tick, std::int64_t now_ns, std::int64_t& messages_left) {
  std::erase_if(rules_unannounced_, [&](CharacterKey key) {
    Character* const character = rooms_->find(key);
    if (!character) return true;
    if (tick < character->touch_rule_announced_next || messages_left <= 0) return false;
    character->touch_rule_announced_next = tick + std::max(1u, tick_rate_hz_ / kRuleChangesPer_s);
    const Room& room = rooms_->room(character->room);
    messages_left -= static_cast<std::int64_t>(room.observers.size());
    const wire::MemberTouch announced = touch_message(*character);
    const std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, announced});
    for (const Observer* observer : room.observers) {
      if (observer->sink && observer->knows(character->slot)) observer->sink->push_encoded(announced, packet, now_ns);
    }
    return true;
  });
}

void Touch::put_inputs(std::int64_t now_ns, wire::RecordedTick& inputs) {
  // The rights after all commands of the tick count, whatever the order of the commands.
  drop_forbidden_pins(inputs);
  std::erase_if(rules_changed_, [&](CharacterKey key) {
    const Character* const character = rooms_->find(key);
    if (character && !character->in_world) return false;
    if (character) inputs.touch_rules.push_back({key, character->touch_rule});
    return true;
  });
  for (Room& room : rooms_->rooms()) {
    if (room.touch.is_changed || !room.touch.touchers.empty()) put_bodies(now_ns, room, inputs);
  }
}

// A command may have forbidden a session to touch the hair after its pin was accepted. Such a pin drops the hair
// instead.
void Touch::drop_forbidden_pins(SimulationInputs& inputs) const {
  for (SimulationInputs::LetGo& release : inputs.releases) {
    if (release.release != Release::pin) continue;
    const Observer* const maker = rooms_->observer(release.hand.toucher);
    const Character* const character = rooms_->find(release.character);
    if (maker && character && !may_touch(*maker, *character)) release.release = Release::drop;
  }
}

void Touch::put_bodies(std::int64_t now_ns, Room& room, wire::RecordedTick& inputs) {
  RoomTouch& touch = room.touch;
  tell_props(room, now_ns);
  touch.props_changed.clear();
  bool is_changed = std::exchange(touch.is_changed, false);
  for (Observer* observer : touch.touchers) {
    // Hands are sampled at the same time as poses, so that a hand meets the head where it was then.
    std::vector<Hand> hands = observer->inbox.sample(inputs.sample_time_ns);
    is_changed = is_changed || !are_same(hands, observer->hands);
    observer->hands = std::move(hands);
  }
  // A session that has no hands at this time and no later sample is not sampled any more, until it sends hands again.
  std::erase_if(touch.touchers, [&](const Observer* observer) {
    return observer->hands.empty() && !observer->inbox.is_newer_than(inputs.sample_time_ns);
  });
  if (!is_changed) return;
  std::vector<TouchBody> bodies = bodies_of(touch);
  // A jump is true for one step: afterwards the prop moves again, and pushes hair by its speed.
  for (auto& [number, prop] : touch.props) prop.has_jumped = false;
  if (bodies.empty() && !touch.is_in_world) return;
  touch.is_in_world = !bodies.empty();
  inputs.bodies.push_back({room.index, std::move(bodies)});
}

void Touch::tell_props(const Room& room, std::int64_t now_ns) const {
  if (room.touch.props_changed.empty()) return;
  wire::RoomProps announced;
  for (const std::uint8_t number : room.touch.props_changed) {
    const auto prop = room.touch.props.find(number);
    if (prop == room.touch.props.end())
      announced.removed.push_back(number);
    else
      announced.props.push_back(prop->second);
  }
  const std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, announced});
  for (const Observer* observer : room.observers) {
    if (observer->sink) observer->sink->push_encoded(announced, packet, now_ns);
  }
}

void Touch::tell_holds(const Simulation& simulation, const wire::RecordedTick& inputs, std::int64_t now_ns) {
  HAIRNET_ASSERT(simulation.held_counts().size() == inputs.grabs.size());
  for (std::size_t i = 0; i < inputs.grabs.size(); ++i) {
    const Hold hold{inputs.grabs[i].character, inputs.grabs[i].grab.hand};
    const std::uint32_t point_count = simulation.held_counts()[i];
    if (point_count > 0) {
      counters_->holds_taken.add();
      holds_.insert(hold);
    } else {
      counters_->holds_refused_out_of_reach.add();
      holds_.erase(hold);
    }
    tell_held(hold, point_count, now_ns);
  }
  std::erase_if(holds_, [&](const Hold& hold) {
    // A hold ends by itself when its hair is stretched too far, when the level changes, or when the hand has gone.
    if (simulation.held_count(hold.character, hold.hand) > 0) return false;
    counters_->holds_ended.add();
    tell_held(hold, 0, now_ns);
    return true;
  });
  for (const Hold& hold : holds_) {
    Character* const character = rooms_->find(hold.character);
    HAIRNET_ASSERT(character);
    // LevelChooser leaves such a character on its level.
    character->held_tick = inputs.tick;
  }
}

void Touch::tell_held(const Hold& hold, std::uint32_t point_count, std::int64_t now_ns) const {
  const Observer* const holder = rooms_->observer(hold.hand.toucher);
  const Character* const character = rooms_->find(hold.character);
  if (!holder || !holder->sink || !character) return;
  holder->sink->push(wire::Held{member_of(*character), hold.hand.number, point_count}, now_ns);
}

void Touch::refuse(const Observer& observer, wire::ErrorReason reason, std::string detail, std::int64_t now_ns) {
  if (observer.sink) observer.sink->push(wire::Error{reason, 0, {}, std::move(detail)}, now_ns);
}

void Touch::show_hands(const wire::RecordedTick& inputs, const ParallelFor& parallel_for, std::int64_t now_ns) {
  for (Room& room : rooms_->rooms()) {
    if (room.touch.touchers.empty() && !room.touch.are_hands_shown) continue;
    find_near_hands(room);
    run_chunks(parallel_for, room.observers.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) show_hands(inputs, now_ns, *room.observers[i]);
    });
    room.touch.are_hands_shown =
        std::ranges::any_of(room.observers, [](const Observer* observer) { return !observer->hands_shown.empty(); });
  }
}

void Touch::find_near_hands(const Room& room) {
  near_.clear();
  heads_.clear();
  for (const Room::Slot& slot : room.slots) {
    const Character* const character = slot.character;
    if (character && character->in_world) heads_.push_back({character->pose.head().position.x(), character});
  }
  // Sorted by x, the heads near a hand are one run of the array: a crowd costs a search for each hand, and not a test
  // of every pair.
  std::ranges::sort(heads_, {}, &Head::x_m);
  for (const Observer* person : room.touch.touchers) {
    NearHands near{person, {}};
    for (const Hand& hand : person->hands) {
      const Vec3& place = hand.place.position;
      const double reach_m = kShownReach_m + extent_m(hand);
      auto head = std::ranges::lower_bound(heads_, place.x() - reach_m, {}, &Head::x_m);
      for (; head != heads_.end() && head->x_m <= place.x() + reach_m; ++head) {
        const Character& character = *head->character;
        // A person who may not touch others pushes only the hair of own characters, so other heads do not count.
        if (!person->may_touch_others && session_of(character.key) != person->session) continue;
        if ((character.pose.head().position - place).norm() <= reach_m) near.slots.push_back(character.slot);
      }
    }
    if (near.slots.empty()) continue;
    // The bytes are the same for each observer, so they are made once.
    near.bytes = codec::encode_hands(person->hands);
    near_.push_back(std::move(near));
  }
}

// Runs on workers, each for different observers: the function writes to this observer alone.
void Touch::show_hands(const wire::RecordedTick& inputs, std::int64_t now_ns, Observer& observer) const {
  if (!observer.sink || !observer.sink->takes_room_hands()) return;
  const std::size_t datagram_bytes_max = observer.sink->datagram_bytes_max();
  wire::EncodedRoomHands shown{inputs.tick, inputs.sample_time_ns, {}};
  std::size_t shown_bytes = kRoomHandsBytes;
  const auto put_packet = [&] {
    if (shown.people.empty()) return;
    std::vector<std::uint8_t> packet = wire::encode_room_hands(now_ns, shown);
    HAIRNET_ASSERT(!packet.empty());
    const bool may_be_lost = packet.size() <= datagram_bytes_max;
    observer.hand_packets.push_back({std::move(packet), 0, may_be_lost});
    shown.people.clear();
    shown_bytes = kRoomHandsBytes;
  };
  std::vector<SessionId> sessions;
  for (const NearHands& near : near_) {
    if (sessions.size() == kPeopleShownMax) break;
    // Hands without the hair that they touch would be of no use to the observer.
    if (near.person == &observer || !sees_any(observer, near.slots)) continue;
    const std::size_t person_bytes = kPersonBytes + near.bytes.size();
    // Many people are split over several packets. Each fits a datagram, and a client can use it without the others.
    if (datagram_bytes_max > 0 && shown_bytes + person_bytes > datagram_bytes_max) put_packet();
    shown_bytes += person_bytes;
    shown.people.push_back({near.person->session, near.bytes});
    sessions.push_back(near.person->session);
  }
  put_packet();
  // The people whose hands the session gets no more. This goes by the reliable channel: no later packet repeats it.
  std::vector<SessionId> gone;
  std::ranges::set_difference(observer.hands_shown, sessions, std::back_inserter(gone));
  if (!gone.empty()) {
    wire::RoomHands without{inputs.tick, inputs.sample_time_ns, {}};
    for (const SessionId session : gone) without.people.push_back({session, {}});
    observer.sink->push(without, now_ns);
  }
  observer.hands_shown = std::move(sessions);
}

}  // namespace hairnet::server
