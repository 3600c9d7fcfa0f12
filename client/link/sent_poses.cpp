#include "client/link/sent_poses.hpp"

#include <algorithm>

namespace hairnet::link {

void SentPoses::repeat_in(wire::PoseBatch& batch) {
  for (auto pose = batch.poses.begin(); pose != batch.poses.end(); ++pose) {
    const auto is_same = [&](const wire::PoseSample& other) { return other.character == pose->character; };
    if (std::any_of(batch.poses.begin(), pose, is_same)) continue;
    for (const wire::PoseSample& earlier : sent_[pose->character])
      if (pose->capture_time_ns - earlier.capture_time_ns <= kAgeMax_ns) batch.earlier.push_back(earlier);
  }
  for (const wire::PoseSample& pose : batch.poses) {
    std::vector<wire::PoseSample>& sent = sent_[pose.character];
    if (sent.size() == kPosesMax) sent.erase(sent.begin());
    sent.push_back(pose);
  }
}

}  // namespace hairnet::link
