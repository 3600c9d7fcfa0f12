#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "client/link/playout.hpp"
#include "core/levels/level.hpp"

namespace hairnet::link {

// SwitchBlend for programs that deform on the GPU: it keeps lattices in place of points. FFD is linear in the
// displacements, so the points that SwitchBlend would give are those of a weighted sum of lattices' fields,
//
//     u(x) = u_newest(x) + w (u_before(x) - u_after(x)) + ...,     w fading from 1 to 0 over kSwitchBlend_ns,
//
// u_before and u_after are frozen at the moment of the switch. If a switch happens during a fade, the rest of that fade
// becomes part of the new one. One object per character; one thread.
class LatticeBlend {
 public:
  // Takes the samples of one Playout in order of time and skips those that are not valid. A `discontinuous` sample, or
  // another geometry of the same level, ends all fades: there is nothing to blend from.
  void apply(const Playout::Sample& sample, bool discontinuous = false);

  // Of the sample applied last, the newest lattice first; none: the hair is rigid. Valid until the next apply(), or
  // until this is moved.
  [[nodiscard]] std::span<const LatticeLayer> layers() const { return {layers_.data(), layer_count_}; }

 private:
  struct Field {
    std::shared_ptr<const LevelGeometry> geometry;  // null: rigid
    std::vector<Vec3f> grid;
  };
  // One switch: its two lattices, and by how much of their difference hair was off when it began to fade.
  struct Switch {
    Field before, after;
    float share = 1;
  };
  static constexpr std::size_t kSwitchesMax = (kLatticeLayersMax - 1) / 2;

  static void fill(const Playout::Sample& sample, Field& field);
  void begin_switch(std::int64_t time_ns);
  void list_layers();
  void list(const Field& field, float weight);

  bool started_ = false;
  LevelIndex level_ = LevelIndex::rigid;
  std::int64_t switched_ns_ = 0;
  float left_ = 0;  // at the last sample
  Field newest_, last_;
  std::vector<Switch> switches_;  // that fade, together; strongest first
  std::array<LatticeLayer, kLatticeLayersMax> layers_;
  std::size_t layer_count_ = 0;
};

}  // namespace hairnet::link
