#include "client/files/frame_trace.hpp"

#include <array>
#include <filesystem>
#include <utility>

#include "client/files/npy_writer.hpp"

namespace hairnet {

struct FrameTrace::Files {
  NpyWriter frames, poses, displacements;
  std::string folder;
  // The number of rows in displacements.npy so far, which is where the next frame's displacements begin.
  std::int64_t displacement_count = 0;
};

Result<FrameTrace> FrameTrace::create(const std::string& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return Refusal(folder + ": cannot be made: " + error.message());
  // The shapes are those of the rows in `add`: 8 numbers for each frame; a position and a quaternion for each bone; one
  // vector for each displaced node.
  auto frames = NpyWriter::create(folder + "/frames.npy", NpyType::int64, {8});
  auto poses = NpyWriter::create(folder + "/poses.npy", NpyType::float32, {kBoneCount, 7});
  auto displacements = NpyWriter::create(folder + "/displacements.npy", NpyType::float32, {3});
  for (const auto* file : {&frames, &poses, &displacements}) {
    if (!*file) return Refusal(folder + ": " + file->error());
  }
  return FrameTrace(
      std::make_unique<Files>(Files{std::move(*frames), std::move(*poses), std::move(*displacements), folder, 0}));
}

FrameTrace::FrameTrace(std::unique_ptr<Files> files) : files_(std::move(files)) {}
FrameTrace::FrameTrace(FrameTrace&&) noexcept = default;
FrameTrace& FrameTrace::operator=(FrameTrace&&) noexcept = default;
FrameTrace::~FrameTrace() = default;

void FrameTrace::add(const TracedFrame& frame) {
  const auto count = static_cast<std::int64_t>(frame.displacement.size());
  const std::array<std::int64_t, 8> row{static_cast<std::int64_t>(frame.tick),
                                        static_cast<std::int64_t>(frame.character),
                                        static_cast<std::int64_t>(frame.level),
                                        frame.discontinuous ? 1 : 0,
                                        files_->displacement_count,
                                        count,
                                        frame.asleep ? 1 : 0,
                                        frame.step_stride};
  files_->frames.append(row);
  std::array<float, 7 * kBoneCount> pose{};
  for (std::size_t b = 0; b < kBoneCount; ++b) {
    const RigidTransform& bone = frame.pose.bones[b];
    // Floats are what frames carry, so a received trace loses nothing.
    for (int a = 0; a < 3; ++a) pose[7 * b + a] = static_cast<float>(bone.position[a]);
    for (int a = 0; a < 4; ++a) pose[7 * b + 3 + a] = static_cast<float>(bone.rotation.coeffs()[a]);
  }
  files_->poses.append(pose);
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  if (count > 0)
    files_->displacements.append(std::span(frame.displacement.front().data(), 3 * frame.displacement.size()));
  files_->displacement_count += count;
}

Result<void> FrameTrace::finish() {
  // Each array gets its name by itself; after a failure the folder may have some of the three.
  for (NpyWriter* file : {&files_->frames, &files_->poses, &files_->displacements}) {
    if (const Result<void> finished = file->finish(); !finished)
      return Refusal(files_->folder + ": " + finished.error());
  }
  return {};
}

}  // namespace hairnet
