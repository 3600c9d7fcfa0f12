#include "server/tick/publish.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace hairnet::server {
namespace {

bool all_finite(std::span<const Vec3f> displacement) {
  return std::all_of(displacement.begin(), displacement.end(), [](const Vec3f& d) { return d.allFinite(); });
}

struct Made {
  CharacterKey key = 0;
  const Character* character = nullptr;
  wire::Frame frame;
  bool sound = true;
};

}  // namespace

wire::Frame make_frame(CharacterKey key, const Character& character, const LatticeView& lattice) {
  wire::Frame frame;
  frame.character = number_of(key);
  frame.level = lattice.level;
  frame.discontinuous = character.discontinuous;
  frame.asleep = lattice.asleep;
  frame.pose = character.pose;
  if (!lattice.displacement.empty()) wire::encode_displacements(lattice.displacement, frame);
  return frame;
}

void publish(Room& room, const Simulation& simulation, const wire::RecordedTick& tick, const ParallelFor& parallel_for,
             TickCounters& counters) {
  std::vector<Made> made;
  made.reserve(simulation.character_count());
  for (auto& [key, character] : room.characters()) {
    if (!character.placed || !simulation.contains(key)) continue;
    const bool asleep = simulation.lattice(key).asleep && !character.discontinuous;
    if (!std::exchange(character.sleep_told, asleep) || !asleep) made.push_back({key, &character, {}});
  }
  parallel_for(made.size(), [&](std::size_t i) {
    const LatticeView lattice = simulation.lattice(made[i].key);
    made[i].sound = all_finite(lattice.displacement);
    if (made[i].sound) made[i].frame = make_frame(made[i].key, *made[i].character, lattice);
  });

  // Keys are in order, so a session's frames lie side by side.
  for (auto first = made.begin(); first != made.end();) {
    const SessionId session = session_of(first->key);
    const auto last = std::find_if(first, made.end(), [&](const Made& m) { return session_of(m.key) != session; });
    std::vector<wire::Frame> frames;
    frames.reserve(static_cast<std::size_t>(last - first));
    for (auto m = first; m != last; ++m) {
      if (m->sound)
        frames.push_back(std::move(m->frame));
      else
        counters.frames_dropped.add();
    }
    counters.frames_published.add(frames.size());
    const auto observer = room.observers().find(session);
    if (observer != room.observers().end())
      observer->second.outlet->push_frames(tick.tick, tick.sample_time_ns, std::move(frames));
    first = last;
  }
}

}  // namespace hairnet::server
