#include "server/threading/output_thread.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <optional>
#include <string>

#include "server/files/descriptor.hpp"

namespace hairnet::server {
namespace {

using Clock = std::chrono::steady_clock;
using testing::EndsWith;
using testing::HasSubstr;

// No test waits as long as this, unless it fails.
constexpr std::chrono::seconds kLong{60};

// A pipe whose reader is the test. The system's pipe takes `bytes_max` before a write blocks.
struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
    read.emplace(ends[0]);
    write.emplace(ends[1]);
    bytes_max = static_cast<std::size_t>(::fcntl(ends[1], F_GETPIPE_SZ));
  }
  [[nodiscard]] std::string take_all() const {
    std::string text;
    std::array<char, 4096> piece;
    while (true) {
      const ssize_t got = ::read(read->get(), piece.data(), piece.size());
      if (got <= 0) return text;
      text.append(piece.data(), static_cast<std::size_t>(got));
    }
  }
  std::optional<Descriptor> read, write;
  std::size_t bytes_max = 0;
};

class OutputThreadTest : public testing::Test {
 protected:
  OutputThreadDef def(int descriptor) {
    OutputThreadDef made;
    made.descriptor = descriptor;
    made.bytes_max = 1000;
    made.on_lost = [this](std::uint64_t count) { lost_ += count; };
    made.lost_text = [](std::uint64_t count) { return "lost " + std::to_string(count) + "\n"; };
    return made;
  }
  std::atomic<std::uint64_t> lost_{0};
};

TEST_F(OutputThreadTest, writes_texts_in_their_order) {
  Pipe pipe;
  OutputThread output(def(pipe.write->get()));
  output.put("one\n");
  output.put("two\n");
  output.finish(Clock::now() + kLong);
  pipe.write->close();
  EXPECT_EQ(pipe.take_all(), "one\ntwo\n");
  EXPECT_EQ(lost_, 0u);
}

TEST_F(OutputThreadTest, a_reader_who_stalls_costs_the_oldest_texts_and_is_told_how_many) {
  Pipe pipe;
  const std::string line(99, 'x');
  // The pipe is full before the first text, so its size does not decide how many texts are lost.
  const std::string full = std::string(pipe.bytes_max - 1, 'x') + "\n";
  ASSERT_EQ(::write(pipe.write->get(), full.data(), full.size()), static_cast<ssize_t>(full.size()));
  std::size_t count = 0;
  {
    OutputThread output(def(pipe.write->get()));
    // The queue has room for 1000 bytes (bytes_max), which are ten of these lines.
    for (; count < 1000; ++count) output.put(line + "\n");
    EXPECT_GT(lost_, 0u);
    output.put("newest\n");
    std::thread finish([&output] { output.finish(Clock::now() + kLong); });
    std::string text;
    while (!text.ends_with("newest\n")) {
      char c = 0;
      ASSERT_EQ(::read(pipe.read->get(), &c, 1), 1);
      text += c;
    }
    finish.join();
    // The loss is announced once or twice, since the first text may leave the queue before any text is lost, or after.
    std::size_t announced = 0, lost = 0;
    for (std::size_t at = text.find("lost "); at != std::string::npos; at = text.find("lost ", at + 1)) {
      ++announced;
      lost += std::stoul(text.substr(at + 5));
    }
    EXPECT_GE(announced, 1u);
    EXPECT_LE(announced, 2u);
    EXPECT_EQ(lost, lost_);
    EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(text, '\n')) + lost_, 1 + count + 1 + announced);
  }
}

TEST_F(OutputThreadTest, its_end_does_not_wait_for_a_reader_who_never_reads) {
  // The thread writes until the reader's end wakes it, which may be after this test: the pipe's other end stays open.
  static Pipe* const pipe = std::make_unique<Pipe>().release();
  {
    OutputThread output(def(pipe->write->get()));
    for (std::size_t i = 0; i < pipe->bytes_max; ++i) output.put("0123456789");
    output.finish(Clock::now() + std::chrono::milliseconds(20));
    output.put("too late");
  }
  // The end of the reader also ends the write that blocks.
  pipe->read->close();
}

TEST_F(OutputThreadTest, a_reader_who_is_gone_and_a_full_disk_lose_every_text_and_nothing_else) {
  Pipe pipe;
  pipe.read->close();
  const Descriptor full(::open("/dev/full", O_WRONLY | O_CLOEXEC));
  ASSERT_TRUE(full);
  for (const int descriptor : {pipe.write->get(), full.get()}) {
    lost_ = 0;
    OutputThread output(def(descriptor));
    for (int i = 0; i < 10; ++i) output.put("line\n");
    output.lose();
    output.finish(Clock::now() + kLong);
    // Ten texts and one more that lose() reports are lost.
    EXPECT_EQ(lost_, 11u);
  }
}

}  // namespace
}  // namespace hairnet::server
