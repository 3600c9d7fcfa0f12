#include "client/link/lattice_blend.hpp"

#include <utility>

#include "client/link/switch_blend.hpp"
#include "core/assert.hpp"

namespace hairnet::link {

void LatticeBlend::fill(const Playout::Sample& sample, Field& field) {
  field.geometry = sample.displacement.empty() ? nullptr : sample.geometry;
  field.grid.clear();
  if (!field.geometry) return;
  HAIRNET_ASSERT(sample.displacement.size() == field.geometry->active_nodes.size());
  field.grid.resize(field.geometry->lattice.node_count());
  expand_displacements(*field.geometry, sample.displacement, field.grid);
}

void LatticeBlend::begin_switch(std::int64_t time_ns) {
  for (Switch& fading : switches_) fading.share *= left_;
  std::erase_if(switches_, [](const Switch& fading) { return fading.share <= 0; });
  // Earlier switches have less weight than the new one, the oldest the least.
  switches_.insert(switches_.begin(), {std::move(last_), newest_, 1});
  if (switches_.size() > kSwitchesMax) switches_.pop_back();
  HAIRNET_ASSERT(switches_.size() <= kSwitchesMax);
  switched_ns_ = time_ns;
}

void LatticeBlend::apply(const Playout::Sample& sample, bool discontinuous) {
  if (!sample.valid) return;
  std::swap(last_, newest_);
  fill(sample, newest_);
  const bool other_lattice =
      sample.level == level_ && newest_.geometry && last_.geometry && newest_.geometry != last_.geometry;
  if (!started_ || discontinuous || other_lattice) {
    switches_.clear();
  } else if (sample.level != level_) {
    begin_switch(sample.time_ns);
  }
  started_ = true;
  level_ = sample.level;
  left_ = switches_.empty() ? 0 : SwitchBlend::left_after(sample.time_ns - switched_ns_);
  HAIRNET_ASSERT(left_ >= 0 && left_ <= 1);
  if (left_ <= 0) switches_.clear();
  list_layers();
}

void LatticeBlend::list(const Field& field, float weight) {
  if (!field.geometry) return;
  HAIRNET_ASSERT(layer_count_ < layers_.size());
  HAIRNET_ASSERT(field.grid.size() == field.geometry->lattice.node_count());
  layers_[layer_count_++] = {field.geometry.get(), field.grid, weight};
}

void LatticeBlend::list_layers() {
  layer_count_ = 0;
  list(newest_, 1);
  for (const Switch& fading : switches_) {
    list(fading.before, fading.share * left_);
    list(fading.after, -fading.share * left_);
  }
}

}  // namespace hairnet::link
