#include "server/tick/recorder.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <iterator>

namespace hairnet::server {
namespace {

// The hash is an arbitrary number that depends on the tick, so that a test can tell entries from each other.
wire::RecordedTick tick(std::uint64_t number) {
  wire::RecordedTick made;
  made.tick = number;
  made.state_hash = number * 7;
  return made;
}

TEST(Recorder, writes_what_was_put_in_order) {
  const std::string path = testing::TempDir() + "hairnet_recorder_test.hairrec";
  TickCounters counters;
  {
    auto recorder = Recorder::create(path, counters);
    ASSERT_TRUE(recorder) << recorder.error();
    wire::RecordingHeader header;
    header.iterations = 5;
    (*recorder)->put(header);
    (*recorder)->put(tick(1));
    EXPECT_TRUE((*recorder)->poll());
    (*recorder)->put(tick(2));
    EXPECT_TRUE((*recorder)->poll());
    // Everything is written, so poll() has nothing to do. The recorder's destructor closes the file.
    EXPECT_FALSE((*recorder)->poll());
  }
  std::ifstream file(path, std::ios::binary);
  const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
  std::remove(path.c_str());
  std::span<const std::uint8_t> rest = bytes;
  EXPECT_EQ(std::get<wire::RecordingHeader>(*wire::take_record_entry(rest)).iterations, 5);
  EXPECT_EQ(std::get<wire::RecordedTick>(*wire::take_record_entry(rest)).state_hash, 7u);
  EXPECT_EQ(std::get<wire::RecordedTick>(*wire::take_record_entry(rest)).tick, 2u);
  EXPECT_TRUE(rest.empty());
  EXPECT_EQ(counters.ticks_recorded.value(), 2u);
}

TEST(Recorder, a_full_disk_ends_the_recording_and_nothing_else) {
  TickCounters counters;
  // Each write to /dev/full fails as on a full disk.
  auto recorder = Recorder::create("/dev/full", counters);
  if (!recorder) GTEST_SKIP() << "no /dev/full here";
  for (std::uint64_t i = 0; i < 100; ++i) {
    (*recorder)->put(tick(i));
    (*recorder)->poll();
  }
  EXPECT_TRUE((*recorder)->failed());
  EXPECT_EQ(counters.recordings_failed.value(), 1u);
}

TEST(Recorder, a_path_that_cannot_be_written_is_one_clear_line) {
  TickCounters counters;
  const auto recorder = Recorder::create("/nowhere/at/all.hairrec", counters);
  ASSERT_FALSE(recorder);
  EXPECT_NE(recorder.error().find("/nowhere/at/all.hairrec"), std::string::npos);
}

}  // namespace
}  // namespace hairnet::server
