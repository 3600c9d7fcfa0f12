#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/files/frame_trace.hpp"
#include "client/files/video_writer.hpp"
#include "client/viewer/sources/local_world.hpp"

namespace hairnet::viewer {

// Records a window: a video of its pictures at a fixed rate, and a trace of a local world's ticks, as long as the ticks
// count from one beginning. Files are named hairnet-N.mp4 and hairnet-N.trace, in the folder in which the program was
// started; N is the first free number. Errors are one line. One thread.
class WindowRecorder {
 public:
  // The rate of the video.
  static constexpr double kRate_hz = 30;

  // The size cannot change later: a window that changes its size must end the video.
  Result<void> start_video(int width, int height);
  Result<void> start_trace();
  // Ending what has not begun does nothing.
  Result<void> stop_video();
  Result<void> stop_trace();
  [[nodiscard]] bool has_video() const { return video_.has_value(); }
  [[nodiscard]] bool has_trace() const { return trace_.has_value(); }

  // Whether a picture is due now. The caller reads pixels only then, since that waits for the GPU.
  [[nodiscard]] bool wants_picture(std::int64_t now_ns) const;
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  // RGBA of width() x height(), rows from the bottom, like OpenGL. After an error the video is abandoned.
  Result<void> add_picture(std::span<const std::uint8_t> rgba, std::int64_t now_ns);
  // Call it for each tick: LocalWorld::on_tick.
  void add_tick(const LocalWorld& world);
  // One line about the file that is being written, or the last one; empty when there was none.
  [[nodiscard]] const std::string& status() const { return status_; }

 private:
  std::optional<VideoWriter> video_;
  std::optional<FrameTrace> trace_;
  int width_ = 0, height_ = 0;
  // The time of the first picture, moved forward where pictures were left out.
  std::int64_t begun_ns_ = 0;
  std::uint64_t picture_count_ = 0;
  // A picture with its rows from the top.
  std::vector<std::uint8_t> upright_;
  std::string video_path_, trace_path_, status_;
};

// Adds a local world's state after the last tick; characters have the numbers of viewed_characters().
void add_to_trace(const LocalWorld& world, FrameTrace& trace);

}  // namespace hairnet::viewer
