#include "client/viewer/sources/switch_history.hpp"

#include "client/link/switch_blend.hpp"

namespace hairnet::viewer {
namespace {

constexpr std::size_t kShapesMax = 64;  // of switches that follow each other within the time of a fade

}  // namespace

void SwitchHistory::note(const link::Playout::Sample& sample) {
  const bool switched = started_ && sample.level != last_.level;
  if (switched) around_.push_back(last_);
  started_ = true;
  last_.level = sample.level;
  last_.time_ns = sample.time_ns;
  last_.geometry = sample.geometry;
  last_.displacement.assign(sample.displacement.begin(), sample.displacement.end());
  if (switched) around_.push_back(last_);
  if (around_.size() > kShapesMax) around_.erase(around_.begin(), around_.begin() + 2);
  // An earlier switch matters as long as a later switch began before the earlier fade had ended.
  if (!around_.empty() && last_.time_ns - around_.back().time_ns >= link::SwitchBlend::kSwitchBlend_ns) around_.clear();
}

Moment SwitchHistory::moment(const Pose& pose) const {
  return {pose, last_, {around_.begin(), around_.end()}};
}

}  // namespace hairnet::viewer
