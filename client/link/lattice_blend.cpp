#include "client/link/lattice_blend.hpp"

#include <algorithm>
#include <utility>

#include "client/link/switch_blend.hpp"

namespace hairnet::link {

void LatticeBlend::fill(const Playout::Sample& sample, Field& field) {
  field.geometry = sample.displacement.empty() ? nullptr : sample.geometry;
  field.grid.clear();
  if (!field.geometry) return;
  field.grid.resize(field.geometry->lattice.node_count());
  expand_displacements(*field.geometry, sample.displacement, field.grid);
}

// The weight of the newest fade, like in SwitchBlend.
float LatticeBlend::left_at(std::int64_t time_ns) const {
  const double t = static_cast<double>(time_ns - switched_ns_) / static_cast<double>(SwitchBlend::kSwitchBlend_ns);
  const double gone = std::clamp(t, 0.0, 1.0);
  return static_cast<float>(1 - gone * gone * (3 - 2 * gone));
}

void LatticeBlend::begin_switch(std::int64_t time_ns) {
  for (Switch& fading : switches_) fading.share *= left_;
  std::erase_if(switches_, [](const Switch& fading) { return fading.share <= 0; });
  // Earlier switches have less weight than the new one, the oldest the least.
  switches_.insert(switches_.begin(), {std::move(last_), newest_, 1});
  if (switches_.size() > kSwitchesMax) switches_.pop_back();
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
  left_ = switches_.empty() ? 0 : left_at(sample.time_ns);
  if (left_ <= 0) switches_.clear();
  list_layers();
}

void LatticeBlend::list(const Field& field, float weight) {
  if (field.geometry) layers_[layer_count_++] = {field.geometry.get(), field.grid, weight};
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
