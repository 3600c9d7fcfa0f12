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

// SwitchBlend for programs that deform on the GPU: it stores lattices instead of points. FFD is linear in the
// displacements, so SwitchBlend's points are those of a weighted sum of the fields of lattices,
//
//     u(x) = u_newest(x) + w (u_before(x) - u_after(x)) + ...,     w fading from 1 to 0 over kSwitchBlend_ns,
//
// u_before and u_after are frozen at the moment of the switch. If a switch happens during a fade, the rest of that fade
// becomes part of the new one. One object per character; one thread.
class LatticeBlend {
 public:
  // Takes the samples of one Playout in order of time and skips those that are not valid. Asserts that
  // displacements fit their geometry. A `discontinuous` sample, or
  // another geometry of the same level, ends all fades: there is nothing to blend from.
  void apply(const Playout::Sample& sample, bool discontinuous = false);

  // The layers of the last applied sample, the newest lattice first; empty: the hair is rigid. Valid until the next
  // apply(), or until this object is moved.
  [[nodiscard]] std::span<const LatticeLayer> layers() const { return {layers_.data(), layer_count_}; }

 private:
  struct Field {
    std::shared_ptr<const LevelGeometry> geometry;  // null: rigid
    std::vector<Vec3f> grid;
  };
  // One switch: its two lattices, and the share of their difference by which hair was off when the fade began.
  struct Switch {
    Field before, after;
    float share = 1;
  };
  static constexpr std::size_t kSwitchesMax = (kLatticeLayersMax - 1) / 2;
  static_assert(kSwitchesMax >= 1);

  static void fill(const Playout::Sample& sample, Field& field);
  void begin_switch(std::int64_t time_ns);
  void list_layers();
  void list(const Field& field, float weight);

  bool started_ = false;
  LevelIndex level_ = LevelIndex::rigid;
  std::int64_t switched_ns_ = 0;
  float left_ = 0;  // at the last sample
  Field newest_, last_;
  std::vector<Switch> switches_;  // that are fading; strongest first
  std::array<LatticeLayer, kLatticeLayersMax> layers_;
  std::size_t layer_count_ = 0;
};

}  // namespace hairnet::link
