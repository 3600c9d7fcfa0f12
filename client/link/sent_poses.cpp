#include "client/link/sent_poses.hpp"

#include <algorithm>

#include "schema/wire/earlier_pose.hpp"

namespace hairnet::link {

void SentPoses::repeat_in(wire::PoseBatch& batch) {
  for (auto pose = batch.poses.begin(); pose != batch.poses.end(); ++pose) {
    const auto is_same = [&](const wire::PoseSample& other) { return other.character == pose->character; };
    // Earlier poses are relative to the first one of their character in the batch, as the receiver reads them.
    if (std::any_of(batch.poses.begin(), pose, is_same)) continue;
    for (const wire::PoseSample& sent : sent_[pose->character]) {
      // The server has sampled past it by now.
      if (pose->capture_time_ns - sent.capture_time_ns > kAgeMax_ns) continue;
      if (const auto earlier = wire::to_earlier(sent, *pose)) batch.earlier.push_back(*earlier);
    }
  }
  for (const wire::PoseSample& pose : batch.poses) {
    std::vector<wire::PoseSample>& sent = sent_[pose.character];
    if (sent.size() == kPosesMax) sent.erase(sent.begin());
    sent.push_back(pose);
  }
}

}  // namespace hairnet::link
