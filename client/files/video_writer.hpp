#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "core/result.hpp"
#include "schema/files/output_file.hpp"

namespace hairnet {

// Whether a file of that name is a video: .mp4, .gif or .webm.
bool is_video(std::string_view path);

// Writes pictures of one size, at a fixed rate, to a video through a pipe to ffmpeg. The file appears when the video is
// finished; an abandoned video leaves no file (OutputFile). One thread.
class VideoWriter {
 public:
  // Returns an error for another extension, sizes outside 16 ... 8192, a rate outside 1 ... 240, a missing folder, and
  // without ffmpeg.
  static Result<VideoWriter> create(const std::string& path, int width, int height, double rate_hz);
  VideoWriter(VideoWriter&& other) noexcept;
  VideoWriter& operator=(VideoWriter&&) = delete;
  // Abandons an unfinished video.
  ~VideoWriter();

  // RGBA, rows from the top.
  Result<void> add(std::span<const std::uint8_t> rgba);
  // Waits until ffmpeg has written the video, and gives the file its name. The error has the first line of what ffmpeg
  // says.
  Result<void> finish();

 private:
  explicit VideoWriter(OutputFile file) : file_(std::move(file)) {}
  // Ends ffmpeg, and returns its error output, or an empty string.
  std::string end_process();

  OutputFile file_;
  std::string path_;
  std::size_t picture_bytes_ = 0;
  // The process of ffmpeg, the pipe to its input, and the pipe from its error output.
  int process_ = -1, pictures_fd_ = -1, complaints_fd_ = -1;
};

}  // namespace hairnet
