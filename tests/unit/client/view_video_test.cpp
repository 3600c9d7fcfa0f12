#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "client/files/video_writer.hpp"
#include "client/viewer/offline/window_recorder.hpp"

namespace hairnet::viewer {
namespace {

namespace fs = std::filesystem;

class VideoTest : public ::testing::Test {
 protected:
  VideoTest() : folder_(fs::temp_directory_path() / ("hairnet_clip_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
    before_ = fs::current_path();
    fs::current_path(folder_);
  }
  ~VideoTest() override {
    fs::current_path(before_);
    fs::remove_all(folder_);
  }
  static bool has_ffmpeg() { return std::system("ffmpeg -version >/dev/null 2>&1") == 0; }
  static std::vector<std::uint8_t> picture(int width, int height, std::uint8_t grey) {
    return std::vector<std::uint8_t>(std::size_t{4} * static_cast<std::size_t>(width * height), grey);
  }
  [[nodiscard]] std::size_t file_count() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_, before_;
};

TEST_F(VideoTest, refuses_what_it_cannot_write_in_one_line_and_leaves_no_file) {
  const auto error = [](const Result<VideoWriter>& video) { return video ? std::string() : video.error(); };
  // The formats are .mp4, .gif and .webm, and a side has 16 to 8192 pixels (video_writer.cpp).
  for (const std::string& line :
       {error(VideoWriter::create("a.avi", 64, 64, 30)), error(VideoWriter::create("a", 64, 64, 30)),
        error(VideoWriter::create("a.mp4", 8, 64, 30)), error(VideoWriter::create("a.mp4", 64, 9000, 30)),
        error(VideoWriter::create("a.mp4", 64, 64, 0)), error(VideoWriter::create("a.mp4", 64, 64, std::nan(""))),
        error(VideoWriter::create("nosuch/a.mp4", 64, 64, 30))}) {
    EXPECT_FALSE(line.empty());
    EXPECT_EQ(line.find('\n'), std::string::npos);
  }
  EXPECT_EQ(file_count(), 0u);
}

TEST_F(VideoTest, without_ffmpeg_it_names_what_to_install) {
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nonexistent", 1);
  const Result<VideoWriter> video = VideoWriter::create("a.mp4", 64, 64, 30);
  setenv("PATH", path.c_str(), 1);
  ASSERT_FALSE(video);
  EXPECT_NE(video.error().find("apt-get install ffmpeg"), std::string::npos);
}

TEST_F(VideoTest, a_finished_clip_of_every_kind_is_there_and_no_part_of_it_beside) {
  if (!has_ffmpeg()) GTEST_SKIP() << "there is no ffmpeg";
  for (const char* path : {"a.mp4", "a.gif", "a.webm"}) {
    // Some formats need even sides. For these, odd ones are cut.
    Result<VideoWriter> video = VideoWriter::create(path, 33, 47, 10);
    ASSERT_TRUE(video) << video.error();
    for (std::uint8_t i = 0; i < 5; ++i) ASSERT_TRUE(video->add(picture(33, 47, static_cast<std::uint8_t>(40 * i))));
    EXPECT_FALSE(video->add(picture(32, 47, 0))) << "another size";
    const Result<void> finished = video->finish();
    ASSERT_TRUE(finished) << finished.error();
    EXPECT_GT(fs::file_size(path), 100u);
    EXPECT_FALSE(video->add(picture(33, 47, 0)));
    EXPECT_FALSE(video->finish());
  }
  EXPECT_EQ(file_count(), 3u);
}

TEST_F(VideoTest, what_is_given_up_or_fails_leaves_the_old_file_alone) {
  if (!has_ffmpeg()) GTEST_SKIP() << "there is no ffmpeg";
  {
    Result<VideoWriter> video = VideoWriter::create("a.mp4", 64, 64, 30);
    ASSERT_TRUE(video);
    ASSERT_TRUE(video->add(picture(64, 64, 100)));
  }
  // The video was given up before finish(), so its temporary file must be gone too.
  EXPECT_EQ(file_count(), 0u);
  // A folder in the place of the file lets the last step fail.
  fs::create_directory("b.mp4");
  Result<VideoWriter> video = VideoWriter::create("b.mp4", 64, 64, 30);
  Result<void> done = video ? video->add(picture(64, 64, 100)) : Result<void>(Refusal(video.error()));
  if (done) done = video->finish();
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().find('\n'), std::string::npos);
  EXPECT_TRUE(fs::is_directory("b.mp4"));
  EXPECT_EQ(file_count(), 1u);
}

TEST_F(VideoTest, a_recorder_keeps_its_rate_however_fast_pictures_come) {
  if (!has_ffmpeg()) GTEST_SKIP() << "there is no ffmpeg";
  WindowRecorder recorder;
  ASSERT_TRUE(recorder.start_video(64, 64));
  std::size_t taken = 0;
  // The window shows 200 images a second, of which a video of 30 a second takes some.
  for (std::int64_t now_ns = 0; now_ns < 1'000'000'000; now_ns += 5'000'000) {
    if (!recorder.wants_picture(now_ns)) continue;
    ++taken;
    ASSERT_TRUE(recorder.add_picture(picture(64, 64, 7), now_ns));
  }
  EXPECT_NEAR(static_cast<double>(taken), WindowRecorder::kRate_hz, 2);
  ASSERT_TRUE(recorder.stop_video());
  EXPECT_TRUE(fs::exists("hairnet-1.mp4"));
  ASSERT_TRUE(recorder.start_video(64, 64));
  ASSERT_TRUE(recorder.add_picture(picture(64, 64, 7), 0));
  ASSERT_TRUE(recorder.stop_video());
  EXPECT_TRUE(fs::exists("hairnet-2.mp4")) << "nothing is written over";
}

}  // namespace
}  // namespace hairnet::viewer
