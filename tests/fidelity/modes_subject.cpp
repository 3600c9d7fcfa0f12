#include "tests/fidelity/modes_subject.hpp"

#include <chrono>

#include "core/levels/level_map.hpp"
#include "core/modes/hair_metric.hpp"

namespace hairnet::fidelity {
namespace {

// About so many points of a hairstyle are measured for depth in the skin.
constexpr std::size_t kProbePoints = 1000;

}  // namespace

double now_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

ModesSubject::ModesSubject(const Groom& g, const ModeTraining& training)
    : groom(g), levels(build_levels(g)), strands(sample_strands(g, kProbePoints)) {
  const double start_s = now_s();
  modes = make_modes(groom, levels, {}, {}, training);
  modes_s = now_s() - start_s;
  metric = hair_metric(groom, (*levels)[LevelIndex::high]);
  for (const std::uint32_t probe : strands.probe_points) {
    points.push_back(strands.points[probe]);
    blend.push_back(strands.blend[probe]);
  }
}

double ModesSubject::mean_square_m2(std::span<const Vec3f> d) const {
  const Eigen::Map<const Eigen::Matrix3Xf> nodes(d.data()->data(), 3, static_cast<Eigen::Index>(d.size()));
  return static_cast<double>((nodes * metric).cwiseProduct(nodes).sum());
}

HairDepth::HairDepth(const ModesSubject& subject, std::size_t case_count)
    : subject_(subject),
      body_(subject.groom),
      deformer_((*subject.levels)[LevelIndex::high].geometry.lattice, subject.points, subject.blend,
                FfdKind::quadratic),
      skin_(*(*subject.levels)[LevelIndex::high].skin, subject.groom.materials.base.thickness_m),
      share_(2 * case_count),
      case_count_(case_count) {
  body_.bend(Pose{});
  for (std::size_t i = 0; i < 2 * case_count; ++i) deep_.emplace_back(body_, subject.points);
}

void HairDepth::bend(const Pose& pose) {
  body_.bend(pose);
  pose_ = pose;
  ++moments_;
}

void HairDepth::add(std::size_t which, std::span<const Vec3f> nodes) {
  const LevelGeometry& geometry = (*subject_.levels)[LevelIndex::high].geometry;
  grid_.resize(geometry.lattice.node_count());
  moved_.resize(subject_.points.size());
  expand_displacements(geometry, nodes, grid_);
  deformer_.deform(grid_, moved_);
  share_[which] += deep_[which].share(body_, moved_);
  skin_.push(pose_, subject_.points, subject_.blend, moved_);
  share_[case_count_ + which] += deep_[case_count_ + which].share(body_, moved_);
}

double HairDepth::percent(std::size_t which) const {
  return 100 * share_[which] / static_cast<double>(moments_);
}

}  // namespace hairnet::fidelity
