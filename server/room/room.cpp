#include "server/room/room.hpp"

namespace hairnet::server {

void Room::open(SessionId session, std::shared_ptr<Outlet> outlet) {
  observers_[session].outlet = std::move(outlet);
}

void Room::close(SessionId session) {
  observers_.erase(session);
}

void Room::add(CharacterKey key, const wire::GroomHash& groom, LevelIndex level) {
  Character& character = characters_[key];
  character.groom = groom;
  character.wanted = level;
}

void Room::remove(CharacterKey key) {
  characters_.erase(key);
}

Character* Room::find(CharacterKey key) {
  const auto found = characters_.find(key);
  return found == characters_.end() ? nullptr : &found->second;
}

void Room::put(const PutPoses& batch) {
  for (const PutPoses::Entry& entry : batch.poses) {
    Character* character = find(entry.character);
    if (!character) {
      counters_->poses_rejected_unknown.add();
      continue;
    }
    switch (character->inbox.put(entry.pose, batch.arrived_ns)) {
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

PoseInbox::Sample Room::sample(Character& character, std::int64_t time_ns) {
  PoseInbox::Sample sample = character.inbox.sample(time_ns);
  if (sample.kind == PoseInbox::Kind::extrapolated) counters_->poses_extrapolated.add();
  if (sample.kind == PoseInbox::Kind::stale) counters_->poses_stale.add();
  return sample;
}

}  // namespace hairnet::server
