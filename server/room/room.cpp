#include "server/room/room.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::server {

// Each character has a fast entry, and each room is either in use with a name or free.
void Rooms::check_invariants() const {
  HAIRNET_ASSERT(by_key_.size() == characters_.size());
  HAIRNET_ASSERT(by_name_.size() + free_rooms_.size() == rooms_.size());
}

void Rooms::check_invariants(const Room& room) {
  HAIRNET_ASSERT(room.in_use);
  HAIRNET_ASSERT(room.member_count + room.free_slots.size() == room.slots.size());
  HAIRNET_ASSERT(room.empty_since_ns == 0 || room.is_empty());
  HAIRNET_VALIDATE(std::cmp_equal(room.member_count, std::ranges::count_if(room.slots, [](const Room::Slot& slot) {
                                    return slot.character != nullptr;
                                  })));
}

Room& Rooms::room_named(const std::string& name) {
  if (const auto found = by_name_.find(name); found != by_name_.end()) return rooms_[found->second];
  // Entry::check_room() refuses sessions by the same limit on rooms with sessions. So if the limit is reached here,
  // some rooms are empty and in their grace time.
  if (by_name_.size() >= room_count_max_) forget_longest_empty();
  auto index = static_cast<std::uint32_t>(rooms_.size());
  if (free_rooms_.empty()) {
    rooms_.emplace_back();
  } else {
    index = free_rooms_.back();
    free_rooms_.pop_back();
  }
  // The World has this many environments, one a room.
  HAIRNET_ASSERT(index < kEnvironmentCountMax);
  Room& room = rooms_[index];
  HAIRNET_ASSERT(!room.in_use);
  // The World may still have bodies of the earlier room with this index: they must be replaced, although the new room
  // has none.
  const bool is_touch_in_world = room.touch.is_in_world;
  // Nothing of the earlier room stays but its index and the mark of its bodies.
  room = {};
  room.touch.is_in_world = room.touch.is_changed = is_touch_in_world;
  room.index = index;
  room.in_use = true;
  room.name = name;
  room.wind = room.wind_announced.wind = wind_;
  by_name_.emplace(name, index);
  counters_->rooms_opened.add();
  check_invariants();
  return room;
}

Observer& Rooms::open(SessionId session, const std::string& name, std::shared_ptr<ObserverSink> sink) {
  HAIRNET_ASSERT(session != 0);
  HAIRNET_ASSERT(!observers_.contains(session));
  Room& room = room_named(name);
  room.empty_since_ns = 0;
  Observer& observer = observers_[session];
  observer.session = session;
  observer.room = room.index;
  observer.sink = std::move(sink);
  room.observers.push_back(&observer);
  check_invariants(room);
  return observer;
}

void Rooms::close(SessionId session, std::int64_t now_ns) {
  const auto found = observers_.find(session);
  if (found == observers_.end()) return;
  const auto first = characters_.lower_bound(character_key(session, 0));
  // Keys of one session are adjacent, so the first key from its number on tells whether it has any character.
  HAIRNET_ASSERT(first == characters_.end() || session_of(first->first) != session);
  Room& room = rooms_[found->second.room];
  end_hands(found->second);
  const std::size_t erased = std::erase(room.observers, &found->second);
  HAIRNET_ASSERT(erased == 1);
  observers_.erase(found);
  // When the last observer leaves, the room's wind becomes the server's setting, also if a client of an earlier server
  // has set it. The next change of the wind need not wait, because there is no hair in the room that it could wake.
  if (room.observers.empty()) {
    forget_wind(room);
    room.wind_announced = {room.wind, 0};
    room.wind_changes_next = 0;
  }
  note_empty(room, now_ns);
}

void Rooms::forget_wind(Room& room) {
  room.wind = wind_;
  room.wind_session = 0;
}

Character* Rooms::add(CharacterKey key, const wire::GroomHash& groom, LevelIndex finest) {
  const Observer* owner = observer(session_of(key));
  if (!owner) return nullptr;
  Room& room = rooms_[owner->room];
  HAIRNET_ASSERT(!characters_.contains(key));
  Character& character = characters_[key];
  by_key_[key] = &character;
  is_everyone_current_ = false;
  character.key = key;
  character.room = room.index;
  character.subject = owner->subject;
  character.groom = groom;
  // The character is not in the World yet: Scheduler::place puts it there with its first pose.
  character.requested_level = finest;
  // The slot that became free last is used first. A frame that is still on its way names the old character by its
  // generation.
  if (room.free_slots.empty()) {
    character.slot = static_cast<std::uint32_t>(room.slots.size());
    room.slots.emplace_back();
  } else {
    character.slot = room.free_slots.back();
    room.free_slots.pop_back();
  }
  Room::Slot& slot = room.slots[character.slot];
  HAIRNET_ASSERT(!slot.character);
  slot.character = &character;
  // The generation counts from 1, so a View's 0 matches none.
  ++slot.generation;
  character.generation = static_cast<std::uint8_t>(slot.generation);
  ++room.member_count;
  check_invariants();
  check_invariants(room);
  return &character;
}

void Rooms::remove(CharacterKey key, std::int64_t now_ns) {
  const auto found = characters_.find(key);
  if (found == characters_.end()) return;
  Room& room = rooms_[found->second.room];
  HAIRNET_ASSERT(room.slots[found->second.slot].character == &found->second);
  HAIRNET_ASSERT(room.member_count > 0);
  room.slots[found->second.slot].character = nullptr;
  // The slot's generation stays, for its next character.
  room.free_slots.push_back(found->second.slot);
  --room.member_count;
  characters_.erase(found);
  by_key_.erase(key);
  is_everyone_current_ = false;
  note_empty(room, now_ns);
  check_invariants();
  check_invariants(room);
}

void Rooms::note_empty(Room& room, std::int64_t now_ns) {
  if (room.is_empty() && room.empty_since_ns == 0) room.empty_since_ns = now_ns;
}

void Rooms::poll(std::int64_t now_ns) {
  for (Room& room : rooms_) {
    if (room.in_use && room.empty_since_ns != 0 && now_ns - room.empty_since_ns >= grace_ns_) forget(room);
  }
}

void Rooms::forget_longest_empty() {
  Room* emptiest = nullptr;
  for (Room& room : rooms_) {
    if (!room.in_use || room.empty_since_ns == 0) continue;
    if (!emptiest || room.empty_since_ns < emptiest->empty_since_ns) emptiest = &room;
  }
  if (emptiest) forget(*emptiest);
}

void Rooms::forget(Room& room) {
  HAIRNET_ASSERT(room.in_use);
  HAIRNET_ASSERT(room.is_empty());
  // The Room object stays in rooms_, with in_use false, until room_named() uses its index again.
  by_name_.erase(room.name);
  room.in_use = false;
  HAIRNET_ASSERT(room.touch.touchers.empty());
  room.touch.props.clear();
  // The bodies that the World has of this room must be removed.
  room.touch.is_changed = room.touch.is_in_world;
  free_rooms_.push_back(room.index);
  counters_->rooms_closed.add();
  check_invariants();
}

Character* Rooms::find(CharacterKey key) {
  const auto found = by_key_.find(key);
  return found == by_key_.end() ? nullptr : found->second;
}

std::span<Character* const> Rooms::everyone() {
  if (!std::exchange(is_everyone_current_, true)) {
    everyone_.clear();
    for (auto& [key, character] : characters_) everyone_.push_back(&character);
  }
  HAIRNET_ASSERT(everyone_.size() == characters_.size());
  return everyone_;
}

Observer* Rooms::observer(SessionId session) {
  const auto found = observers_.find(session);
  return found == observers_.end() ? nullptr : &found->second;
}

void Rooms::put(const PutPoses& batch) {
  for (const wire::PoseSample& sample : batch.poses) {
    Character* character = find(character_key(batch.session, sample.character));
    if (!character) {
      counters_->poses_rejected_unknown.add();
      continue;
    }
    switch (character->inbox.put(sample, batch.arrived_ns)) {
      case PoseInbox::Put::accepted:
        counters_->poses_accepted.add();
        break;
      case PoseInbox::Put::stale:
        counters_->poses_rejected_stale.add();
        break;
      case PoseInbox::Put::out_of_order:
        counters_->poses_rejected_out_of_order.add();
        break;
      case PoseInbox::Put::future:
        counters_->poses_rejected_future.add();
        break;
    }
  }
}

void Rooms::put(const PutHands& hands) {
  Observer* const observer = this->observer(hands.session);
  if (!observer) return counters_->hands_rejected_unknown.add();
  switch (observer->inbox.put(hands.sample, hands.arrived_ns)) {
    case HandsInbox::Put::accepted:
      break;
    case HandsInbox::Put::stale:
      return counters_->hands_rejected_stale.add();
    case HandsInbox::Put::out_of_order:
      return counters_->hands_rejected_out_of_order.add();
    case HandsInbox::Put::future:
      return counters_->hands_rejected_future.add();
  }
  counters_->hands_accepted.add();
  std::vector<Observer*>& touchers = rooms_[observer->room].touch.touchers;
  // The list ascends by session: the World must get hands in the same order in every run.
  const auto at = std::ranges::lower_bound(touchers, observer->session, {}, &Observer::session);
  if (at == touchers.end() || *at != observer) touchers.insert(at, observer);
}

void Rooms::end_hands(Observer& observer) {
  observer.inbox.end();
  RoomTouch& touch = rooms_[observer.room].touch;
  std::erase(touch.touchers, &observer);
  // Hands that the last tick had are bodies in the World, which the next tick must remove.
  touch.is_changed = touch.is_changed || !observer.hands.empty();
  observer.hands.clear();
}

PoseInbox::Sample Rooms::sample(Character& character, std::int64_t time_ns) {
  PoseInbox::Sample sample = character.inbox.sample(time_ns);
  if (sample.kind == PoseInbox::Kind::extrapolated) counters_->poses_extrapolated.add();
  if (sample.kind == PoseInbox::Kind::stale) counters_->poses_stale.add();
  return sample;
}

}  // namespace hairnet::server
