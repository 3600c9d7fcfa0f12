#include "tests/whole/network.hpp"

#include <gmock/gmock.h>

#include <algorithm>

namespace hairnet::whole {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Makes a path that loses a fifth of the packets, in bursts, and delays, reorders and repeats others.
PathQuality bad_path() {
  PathQuality path;
  path.jitter_ns = 20 * kMs;
  path.loss = 0.2;
  path.burst_ns = 50 * kMs;
  path.reorder = 0.3;
  path.duplicate = 0.05;
  return path;
}

// One direction of a connection over a lossy path, and collects the bytes and datagrams that arrive. The
// parameter chooses QUIC with datagrams, or TCP.
class LossyPipe : public testing::TestWithParam<bool> {
 protected:
  void make(const PathQuality& path, std::uint64_t seed = 1) {
    NetworkQuality quality;
    quality.set_lossy(path, path, GetParam());
    pipe_ = std::make_shared<Pipe>(timeline_, quality, false, seed);
    pipe_->listen();
    pipe_->on_bytes = [this](std::span<const std::uint8_t> bytes) {
      received_.insert(received_.end(), bytes.begin(), bytes.end());
    };
    pipe_->on_datagram = [this](std::span<const std::uint8_t> bytes) {
      datagrams_.emplace_back(bytes.begin(), bytes.end());
    };
    pipe_->on_end = [this] { has_ended_ = true; };
  }
  void run_for(double seconds) { timeline_.run(timeline_.now_ns() + static_cast<std::int64_t>(1e9 * seconds)); }

  Timeline timeline_;
  std::shared_ptr<Pipe> pipe_;
  Bytes received_;
  std::vector<Bytes> datagrams_;
  bool has_ended_ = false;
};

TEST_P(LossyPipe, carries_bytes_whole_and_in_order_and_then_its_end) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    received_.clear();
    has_ended_ = false;
    make(bad_path(), seed);
    Bytes bytes(50'000);
    for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * i >> 7);
    pipe_->write(bytes);
    pipe_->end();
    run_for(600);
    EXPECT_EQ(received_, bytes) << seed;
    EXPECT_TRUE(has_ended_);
    EXPECT_TRUE(pipe_->is_empty());
  }
}

TEST_P(LossyPipe, goes_on_after_a_long_silence) {
  make(bad_path());
  for (std::size_t i = 0; i < 200; ++i) {
    pipe_->write(Bytes(300, 1));
    // The writer is silent for 30 s at every twentieth write. Timers of loss recovery that end up wrong in a silence
    // would stop the stream forever.
    run_for(i % 20 == 0 ? 30 : 0.02);
  }
  run_for(600);
  EXPECT_EQ(received_.size(), 200u * 300u);
}

INSTANTIATE_TEST_SUITE_P(Network, LossyPipe, testing::Bool(),
                         [](const auto& one) { return std::string(one.param ? "quic" : "tcp"); });

class LossyDatagrams : public LossyPipe {};

TEST_P(LossyDatagrams, lose_and_reorder_and_repeat_some_and_keep_the_others) {
  make(bad_path());
  for (std::uint8_t i = 0; i < 200; ++i) {
    pipe_->write_datagram(Bytes(100, i));
    pipe_->write(Bytes(100, 1));
    run_for(0.033);
  }
  run_for(60);
  EXPECT_EQ(received_.size(), 200u * 100u);
  // A fifth of the 200 is lost and a twentieth repeated, so some 168 are expected. Bursts make the number vary much.
  EXPECT_THAT(datagrams_.size(), testing::AllOf(testing::Gt(120u), testing::Lt(200u)));
  EXPECT_FALSE(std::ranges::is_sorted(datagrams_));
  EXPECT_TRUE(pipe_->datagrams().empty());
}

INSTANTIATE_TEST_SUITE_P(Network, LossyDatagrams, testing::Values(true));

TEST_P(LossyDatagrams, go_no_faster_than_the_path_and_the_sender_learns_how_fast) {
  PathQuality narrow;
  // The loop below offers 1000 bytes every 10 ms for 10 s, twice what the path carries.
  narrow.bytes_per_s = 5e4;
  make(narrow);
  std::size_t refused = 0;
  for (int i = 0; i < 1000; ++i) {
    if (pipe_->datagrams().is_full())
      ++refused;
    else
      pipe_->write_datagram(Bytes(1000, 1));
    run_for(0.01);
  }
  EXPECT_GT(refused, 300u);
  // The path carries 500 datagrams in 10 s. Fewer than half of them would mean that the sender wastes the path.
  EXPECT_LT(datagrams_.size(), 550u);
  EXPECT_GT(datagrams_.size(), 250u);
  // The sender's estimate must be near the path's 50 000 bytes/s, by a factor of four at most.
  EXPECT_GT(pipe_->bytes_per_s(), 2e4);
  EXPECT_LT(pipe_->bytes_per_s(), 2e5);
}

}  // namespace
}  // namespace hairnet::whole
