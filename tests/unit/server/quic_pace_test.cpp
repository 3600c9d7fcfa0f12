#include <algorithm>
#include <cstring>
#include <map>
#include <random>

#include "tests/unit/server/quic_fixture.hpp"

namespace hairnet::quic {
namespace {

constexpr std::size_t kDatagramBytes = 700;
constexpr std::int64_t kTrip_ns = 30'000'000, kTick_ns = 33'333'333, kStep_ns = 500'000;

// The share of packets that the line loses, and the datagrams that the server sends in each tick.
struct Pace {
  double lost;
  std::size_t datagrams_a_tick;
};

// A server sends datagrams of 700 bytes 30 times a second, over a line of 60 ms that loses packets both ways.
class QuicPace : public testing::TestWithParam<Pace> {
 protected:
  QuicPace() {
    network_.join();
    client_ = network_.clients[0].get();
    connection_ = network_.connections[0];
  }
  void run(double seconds) {
    const std::int64_t end_ns = network_.now_ns + static_cast<std::int64_t>(1e9 * seconds);
    std::int64_t next_ns = network_.now_ns;
    for (; network_.now_ns < end_ns; network_.now_ns += kStep_ns) {
      if (network_.now_ns >= next_ns) {
        next_ns += kTick_ns;
        send_frames();
      }
      carry();
    }
  }
  void send_frames() {
    if (const double bytes_per_s = connection_->bytes_per_s(); bytes_per_s > 0)
      bytes_per_s_least_ = std::min(bytes_per_s_least_, bytes_per_s);
    for (std::size_t k = 0; k < GetParam().datagrams_a_tick && connection_->is_writable(); ++k) {
      Bytes datagram(kDatagramBytes);
      const auto number = static_cast<std::uint32_t>(sent_ns_.size());
      std::memcpy(datagram.data(), &number, sizeof number);
      sent_ns_.push_back(network_.now_ns);
      connection_->send_datagram(datagram);
    }
  }
  void carry() {
    const std::int64_t now_ns = network_.now_ns;
    client_->poll(now_ns);
    for (const Bytes& packet : client_->write(now_ns))
      if (!is_lost()) up_.emplace(now_ns + kTrip_ns, packet);
    for (; !up_.empty() && up_.begin()->first <= now_ns; up_.erase(up_.begin()))
      network_.endpoint.receive({client_->path().remote, client_->path().local}, 0, up_.begin()->second, now_ns);
    network_.endpoint.flush(now_ns);
    for (const auto& [to, packet] : std::exchange(network_.in_flight, {}))
      if (!is_lost()) down_.emplace(now_ns + kTrip_ns, packet);
    for (; !down_.empty() && down_.begin()->first <= now_ns; down_.erase(down_.begin()))
      client_->receive(down_.begin()->second, now_ns);
    for (; seen_ < client_->datagrams.size(); ++seen_) {
      std::uint32_t number = 0;
      std::memcpy(&number, client_->datagrams[seen_].data() + 1, sizeof number);
      held_back_ns_max_ = std::max(held_back_ns_max_, now_ns - sent_ns_.at(number) - kTrip_ns);
    }
  }
  bool is_lost() { return static_cast<double>(random_() % 10'000) < 10'000 * GetParam().lost; }

  QuicNetwork network_;
  QuicClient* client_ = nullptr;
  Connection* connection_ = nullptr;
  std::mt19937 random_{3};
  std::multimap<std::int64_t, Bytes> up_, down_;
  std::vector<std::int64_t> sent_ns_;
  std::size_t seen_ = 0;
  std::int64_t held_back_ns_max_ = 0;
  double bytes_per_s_least_ = 1e9;
};

TEST_P(QuicPace, of_frames_is_kept_when_packets_get_lost) {
  constexpr double kRun_s = 60;
  // In the first second the connection measures its round trips.
  run(1);
  bytes_per_s_least_ = 1e9;
  run(kRun_s);
  const auto [lost, datagrams_a_tick] = GetParam();
  EXPECT_GE(sent_ns_.size(), datagrams_a_tick * 30 * static_cast<std::size_t>(kRun_s)) << "some were refused";
  // Lost datagrams are not sent again, and 3 % more may be on their way or lost by chance.
  EXPECT_GT(static_cast<double>(client_->datagrams.size()), (0.97 - lost) * static_cast<double>(sent_ns_.size()));
  EXPECT_LT(held_back_ns_max_, kTick_ns);
  // Frames may take 0.8 of what the network carries (kNetworkShare in frame_throttle.cpp), so it must carry more than
  // 1.25 times their bytes.
  EXPECT_GT(bytes_per_s_least_, 1.3 * 30 * static_cast<double>(datagrams_a_tick * kDatagramBytes))
      << "frames would become coarser";
}

INSTANTIATE_TEST_SUITE_P(Loss, QuicPace, testing::Values(Pace{0, 2}, Pace{0.01, 2}, Pace{0.05, 2}, Pace{0.05, 1}));

}  // namespace
}  // namespace hairnet::quic
