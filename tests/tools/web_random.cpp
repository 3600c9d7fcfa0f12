#include "tests/tools/web_random.hpp"

namespace hairnet {

float WebRandom::real(float most) {
  return most * (static_cast<float>(random_.next() >> 40) / static_cast<float>(1 << 23) - 1);
}

Vec3f WebRandom::vector(float most) {
  const float x = real(most), y = real(most), z = real(most);
  return {x, y, z};
}

std::vector<Vec3f> WebRandom::vectors(std::size_t count, float most) {
  std::vector<Vec3f> out(count);
  for (Vec3f& v : out) v = vector(most);
  return out;
}

LevelGeometry WebRandom::geometry(const std::array<int, 3>& dims) {
  LevelGeometry g;
  g.lattice = {vector(0.3f), Vec3f(0.05f, 0.06f, 0.08f) + vector(0.02f), dims};
  g.active_nodes = {0};
  g.trimmed_begin = {0};
  for (std::uint32_t node = 1; node < g.lattice.node_count(); ++node)
    (below(3) > 0 ? g.active_nodes : g.trimmed_nodes).push_back(node);
  for (std::size_t t = 0; t < g.trimmed_nodes.size(); ++t) {
    for (std::size_t n = 1 + below(3); n > 0; --n) {
      g.trimmed_from.push_back(static_cast<std::uint32_t>(below(g.active_nodes.size())));
      g.trimmed_weights.push_back(real(1));
    }
    g.trimmed_begin.push_back(static_cast<std::uint32_t>(g.trimmed_from.size()));
  }
  return g;
}

LevelGeometry WebRandom::geometry_around(std::span<const Vec3f> points) {
  LevelGeometry g = geometry({5, 5, 5});
  Vec3f least = Vec3f::Constant(-0.1f), most = Vec3f::Constant(0.1f);
  for (const Vec3f& p : points) {
    least = least.cwiseMin(p);
    most = most.cwiseMax(p);
  }
  g.lattice.origin = 0.8f * least;
  g.lattice.spacing = 0.2f * (most - least);
  return g;
}

}  // namespace hairnet
