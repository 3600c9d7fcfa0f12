#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "core/ffd/deform.hpp"
#include "core/ffd/skin_push.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "tests/fidelity/depth_in_skin.hpp"
#include "tests/fidelity/strand_sample.hpp"

namespace hairnet::fidelity {

// Returns a time whose differences count.
double now_s();

// A hairstyle that was made into modes.
struct ModesSubject {
  ModesSubject(const Groom& groom, const ModeTraining& training);

  // Averages squares over the hair's points, which follow displacements of the finest level's active nodes, m.
  [[nodiscard]] double mean_square_m2(std::span<const Vec3f> displacements) const;

  Groom groom;
  std::shared_ptr<const LevelSet> levels;
  StrandSample strands;
  // The points that are measured for depth in the skin; head space, m.
  std::vector<Vec3f> points;
  std::vector<float> blend;
  std::shared_ptr<const Modes> modes;
  double modes_s = 0;
  Eigen::MatrixXf metric;
};

// Shares of the hair's points that lie too deep in the body, of several cases of the same motion.
class HairDepth {
 public:
  // `subject` must outlive it.
  HairDepth(const ModesSubject& subject, std::size_t case_count);

  void bend(const Pose& pose);
  // Measures one case, given the displacements of the finest level's active nodes.
  void add(std::size_t which, std::span<const Vec3f> nodes);
  // Returns the share of points that are too deep. Numbers below case_count are cases as the lattice moves them; the
  // same cases after the push follow from case_count on.
  [[nodiscard]] double percent(std::size_t which) const;

 private:
  const ModesSubject& subject_;
  BentBody body_;
  Deformer deformer_;
  SkinPush skin_;
  Pose pose_;
  std::vector<DeepPoints> deep_;
  std::vector<Vec3f> grid_, moved_;
  std::vector<double> share_;
  std::size_t case_count_, moments_ = 0;
};

}  // namespace hairnet::fidelity
