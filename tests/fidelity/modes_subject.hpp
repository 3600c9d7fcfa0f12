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

double now_s();  // for differences of times

// A hairstyle that was made into modes.
struct ModesSubject {
  ModesSubject(const Groom& groom, const ModeTraining& training);

  // Averages squares over the hair's points, which follow displacements of the finest level's active nodes, m.
  [[nodiscard]] double mean_square_m2(std::span<const Vec3f> displacements) const;

  Groom groom;
  std::shared_ptr<const LevelSet> levels;
  StrandSample strands;
  std::vector<Vec3f> points;  // for depth in the skin, head space, m
  std::vector<float> blend;
  std::shared_ptr<const Modes> modes;
  double modes_s = 0;
  Eigen::MatrixXf metric;
};

// Shares of the hair's points that lie too deep in the body, of several cases of the same motion.
class HairDepth {
 public:
  HairDepth(const ModesSubject& subject, std::size_t case_count);  // `subject` must outlive it

  void bend(const Pose& pose);
  // Displacements of the finest level's active nodes.
  void add(std::size_t which, std::span<const Vec3f> nodes);
  // As deformed; then, from case_count on, of the same cases after the push.
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
