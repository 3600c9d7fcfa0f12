#include "client/viewer/offline/window_recorder.hpp"

#include <algorithm>
#include <filesystem>

namespace hairnet::viewer {
namespace {

// A slow window repeats a picture up to 15 times, half a second. After a longer standstill, as when the window was
// minimized, the missed pictures are left out.
constexpr std::uint64_t kCatchUpMax = 15;

// A recording begins at the press of a key, so it must not replace a file.
std::string free_path(const char* ending) {
  for (int n = 1; n < 10'000; ++n) {
    std::string path = "hairnet-" + std::to_string(n) + ending;
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored)) return path;
  }
  // After 9999 recordings in one folder this name is used again.
  return std::string("hairnet") + ending;
}

}  // namespace

Result<void> WindowRecorder::start_video(int width, int height) {
  video_path_ = free_path(".mp4");
  Result<VideoWriter> video = VideoWriter::create(video_path_, width, height, kRate_hz);
  if (!video) return Refusal(video.error());
  video_.emplace(std::move(*video));
  width_ = width;
  height_ = height;
  picture_count_ = 0;
  status_ = "recording " + video_path_;
  return {};
}

Result<void> WindowRecorder::stop_video() {
  if (!video_) return {};
  Result<void> finished = video_->finish();
  video_.reset();
  status_ = finished ? "wrote " + video_path_ : "";
  return finished;
}

Result<void> WindowRecorder::start_trace() {
  trace_path_ = free_path(".trace");
  Result<FrameTrace> trace = FrameTrace::create(trace_path_);
  if (!trace) return Refusal(trace.error());
  trace_.emplace(std::move(*trace));
  status_ = "recording " + trace_path_;
  return {};
}

Result<void> WindowRecorder::stop_trace() {
  if (!trace_) return {};
  Result<void> finished = trace_->finish();
  trace_.reset();
  status_ = finished ? "wrote " + trace_path_ : "";
  return finished;
}

// The first picture is wanted at once; it sets the time from which others count.
bool WindowRecorder::wants_picture(std::int64_t now_ns) const {
  return video_ && (picture_count_ == 0 ||
                    1e-9 * static_cast<double>(now_ns - begun_ns_) * kRate_hz >= static_cast<double>(picture_count_));
}

Result<void> WindowRecorder::add_picture(std::span<const std::uint8_t> rgba, std::int64_t now_ns) {
  if (!video_) return {};
  // The video begins with the first picture, not when ffmpeg was started.
  if (picture_count_ == 0) begun_ns_ = now_ns;
  const std::size_t row = std::size_t{4} * static_cast<std::size_t>(width_);
  // The rows come from OpenGL, bottom first; a video has them top first.
  upright_.resize(rgba.size());
  for (std::size_t at = 0; at + row <= rgba.size(); at += row)
    std::copy_n(rgba.begin() + static_cast<std::ptrdiff_t>(at), row,
                upright_.end() - static_cast<std::ptrdiff_t>(at + row));
  // `due` is the number of pictures that a video of this length has.
  const auto due = static_cast<std::uint64_t>(1e-9 * static_cast<double>(now_ns - begun_ns_) * kRate_hz) + 1;
  const std::uint64_t missing = due > picture_count_ ? due - picture_count_ : 0;
  // After a long standstill the clock of the video is set forward, so that only one picture is added.
  if (missing > kCatchUpMax) begun_ns_ += static_cast<std::int64_t>(1e9 * static_cast<double>(missing - 1) / kRate_hz);
  // A slow window repeats its picture, so that the video keeps real time.
  for (std::uint64_t i = 0; i < (missing > kCatchUpMax ? 1 : missing); ++i) {
    Result<void> added = video_->add(upright_);
    if (!added) {
      // The encoder is gone, so the video cannot be finished.
      video_.reset();
      status_.clear();
      return added;
    }
    ++picture_count_;
  }
  return {};
}

void WindowRecorder::add_tick(const LocalWorld& world) {
  if (trace_) add_to_trace(world, *trace_);
}

void add_to_trace(const LocalWorld& world, FrameTrace& trace) {
  for (const ViewedCharacter& character : world.viewed_characters()) {
    const std::optional<LatticeView> lattice = world.lattice(character.id);
    if (!lattice) continue;
    trace.add({world.ticks().back().number, character.id, lattice->level, lattice->discontinuous, lattice->asleep,
               *lattice->pose, lattice->displacement, 1});
  }
}

}  // namespace hairnet::viewer
