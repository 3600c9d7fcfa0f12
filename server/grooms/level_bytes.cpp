#include "server/grooms/level_bytes.hpp"

#include <vector>

#include "core/assert.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/levels/level_map.hpp"
#include "core/modes/make_modes.hpp"

namespace hairnet::server {
namespace {

template <class T>
std::size_t bytes_of(const std::vector<T>& items) {
  return items.size() * sizeof(T);
}

// Sizes and not capacities count, so the sum is a lower bound.
std::size_t bytes_of(const Stiffeners& s) {
  return bytes_of(s.begin) + bytes_of(s.nodes) + bytes_of(s.weights) + bytes_of(s.stiffness) + bytes_of(s.damping) +
         bytes_of(s.rest);
}

std::size_t bytes_of(const ContactPoints& c) {
  return bytes_of(c.begin) + bytes_of(c.nodes) + bytes_of(c.weights) + bytes_of(c.rest) + bytes_of(c.potential) +
         bytes_of(c.limit);
}

std::size_t bytes_of(const Skin& skin) {
  std::size_t bytes = skin.size() * sizeof(SkinDistanceField);
  for (const SkinDistanceField& field : skin) bytes += bytes_of(field.distance);
  return bytes;
}

std::size_t bytes_of(const Level& level) {
  const LevelGeometry& g = level.geometry;
  std::size_t bytes = sizeof(Level) + bytes_of(g.active_nodes) + bytes_of(g.trimmed_nodes) + bytes_of(g.trimmed_begin) +
                      bytes_of(g.trimmed_from) + bytes_of(g.trimmed_weights) + bytes_of(level.rest) +
                      bytes_of(level.mass) + bytes_of(level.ether_stiffness) + bytes_of(level.ether_damping) +
                      bytes_of(level.drag) + bytes_of(level.springs) + bytes_of(level.attachments) +
                      bytes_of(level.contacts);
  return bytes;
}

std::size_t bytes_of(const Modes& modes) {
  std::size_t bytes =
      sizeof(Modes) + bytes_of(modes.basis.deviation_m) + bytes_of(modes.basis.unit) + bytes_of(modes.basis.modes);
  for (const ModeMap& map : modes.maps) bytes += static_cast<std::size_t>(map.matrix().size()) * sizeof(float);
  return bytes;
}

}  // namespace

std::size_t level_bytes(const LevelSet& set) {
  // All levels of a set share one skin, so it counts once.
  HAIRNET_ASSERT(set.levels.front().skin);
  std::size_t bytes = bytes_of(*set.levels.front().skin);
  for (const Level& level : set.levels) bytes += bytes_of(level);
  for (const auto& maps : set.maps)
    for (const auto& map : maps)
      if (map) bytes += map->bytes();
  if (set.modes) bytes += bytes_of(*set.modes);
  if (set.learnt) bytes += set.learnt->bytes();
  return bytes;
}

}  // namespace hairnet::server
