#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hairnet::viewer {

// Whether a file of that name is a video: .mp4, .gif or .webm.
bool is_video(std::string_view path);

// Pictures of one size, at a fixed rate, to a video: a pipe to the program ffmpeg. The file appears when the video is
// finished; what was given up leaves none. One thread.
class VideoWriter {
 public:
  // Refuses another ending, sizes beyond 16 ... 8192, a rate beyond 1 ... 240, a folder that is not there, and a
  // machine without ffmpeg.
  static Result<VideoWriter> create(const std::string& path, int width, int height, double rate_hz);
  VideoWriter(VideoWriter&& other) noexcept;
  VideoWriter& operator=(VideoWriter&&) = delete;
  ~VideoWriter();  // gives up what was not finished

  // RGBA, rows from the top.
  Result<void> add(std::span<const std::uint8_t> rgba);
  Result<void> finish();

 private:
  VideoWriter() = default;
  std::string end_process();  // what it complained of, or empty

  std::string path_, part_;
  std::size_t picture_bytes_ = 0;
  int process_ = -1, pictures_fd_ = -1, complaints_fd_ = -1;
};

}  // namespace hairnet::viewer
