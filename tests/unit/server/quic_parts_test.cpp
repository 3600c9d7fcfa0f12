#include <gmock/gmock.h>
#include <gnutls/crypto.h>
#include <gnutls/x509.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "schema/quic/answer_delay.hpp"
#include "schema/quic/datagram_queue.hpp"
#include "schema/quic/send_buffer.hpp"
#include "server/quic/outgoing.hpp"
#include "server/quic/own_certificates.hpp"
#include "tests/support/quic_client.hpp"

namespace hairnet::quic {
namespace {

constexpr std::int64_t kNow_s = 1'800'000'000, kDay_s = OwnCertificates::kDay_s;

TEST(QuicDatagramQueue, goes_first_but_lets_every_fourth_packet_be_a_streams) {
  DatagramQueue queue;
  // A stream always waits, so after three datagrams in a row (kInARowMax) a packet is a stream's: three of fifteen
  // packets.
  for (std::uint8_t n = 0; n < 12; ++n) queue.push({n});
  std::vector<bool> order;
  while (!queue.empty()) {
    order.push_back(queue.is_next(true));
    if (order.back())
      queue.pop();
    else
      queue.on_stream_sent();
  }
  EXPECT_EQ(std::ranges::count(order, false), 3);
  EXPECT_THAT(std::vector(order.begin(), order.begin() + 5), testing::ElementsAre(true, true, true, false, true));
  queue.push({1});
  for (int n = 0; n < 10; ++n) {
    EXPECT_TRUE(queue.is_next(false)) << "no stream waits";
    queue.pop();
    queue.push({1});
  }
}

TEST(QuicDatagramQueue, is_full_by_its_bytes_and_gives_what_came_first) {
  DatagramQueue queue;
  EXPECT_FALSE(queue.is_next(false));
  for (std::uint8_t n = 0; !queue.is_full(); ++n) queue.push(std::vector<std::uint8_t>(1000, n));
  // The queue is full from kBytesMax (8192 bytes) on, which the ninth datagram of 1000 bytes exceeds.
  EXPECT_EQ(queue.bytes(), 9000u);
  EXPECT_EQ(queue.front()[0], 0);
  EXPECT_EQ(queue.pop()[0], 0);
  EXPECT_FALSE(queue.is_full());
  queue.clear();
  EXPECT_EQ(queue.bytes(), 0u);
  EXPECT_TRUE(queue.empty());
}

TEST(QuicAnswerDelay, holds_an_answer_until_something_goes_or_a_tick_is_over) {
  constexpr std::int64_t kDelay_ns = AnswerDelay::kDelay_ns;
  AnswerDelay answer;
  EXPECT_FALSE(answer.holds(1)) << "nothing was sent before";
  answer.on_datagram(1000);
  EXPECT_TRUE(answer.holds(1000));
  answer.on_datagram(2000);
  EXPECT_EQ(answer.due_ns(5), 1000 + kDelay_ns) << "the first one's time";
  EXPECT_FALSE(answer.holds(1000 + kDelay_ns));
  answer.on_written(true, 3000);
  EXPECT_TRUE(answer.holds(1000 + kDelay_ns));
  EXPECT_EQ(answer.due_ns(5), 3000 + kDelay_ns);
  EXPECT_EQ(answer.due_ns(4000 + kDelay_ns), 4000 + kDelay_ns) << "QUIC has nothing to do before";
}

TEST(QuicAnswerDelay, holds_nothing_that_is_urgent_or_much_until_it_has_been_sent) {
  AnswerDelay answer;
  answer.on_written(true, 1000);
  answer.send_soon();
  EXPECT_FALSE(answer.holds(1000));
  EXPECT_EQ(answer.due_ns(1500), 1500);
  answer.on_written(false, 1000);
  EXPECT_FALSE(answer.holds(1000));
  answer.on_written(true, 1000);
  EXPECT_TRUE(answer.holds(1000));
  for (int n = 0; n < AnswerDelay::kDatagramsMax; ++n) answer.on_datagram(2000);
  EXPECT_FALSE(answer.holds(2000));
  answer.on_written(false, 2000);
  EXPECT_EQ(answer.due_ns(2500), 2500);
}

TEST(QuicAnswerDelay, of_a_client_is_shorter_on_a_long_line) {
  constexpr std::int64_t kMilli_ns = 1'000'000;
  EXPECT_EQ(AnswerDelay::of_client(0), AnswerDelay::kDelay_ns);
  // Round trip and delay together last 60 ms (AnswerDelay::kTogether_ns), between the bounds of the delay.
  EXPECT_EQ(AnswerDelay::of_client(40 * kMilli_ns), 20 * kMilli_ns);
  EXPECT_EQ(AnswerDelay::of_client(500 * kMilli_ns), AnswerDelay::kDelay_ns_min);
  AnswerDelay answer;
  answer.set_delay(20 * kMilli_ns);
  answer.on_written(true, 1000);
  EXPECT_EQ(answer.due_ns(5), 1000 + 20 * kMilli_ns);
}

TEST(QuicOwnCertificates, are_valid_for_less_than_the_14_days_that_browsers_take) {
  EXPECT_LE(OwnCertificates::kValid_s, 14 * kDay_s);
  EXPECT_GE(OwnCertificates::kValid_s, 10 * kDay_s);
  // Whoever asked for the hashes just before a change can connect until the certificate ends.
  EXPECT_GT(OwnCertificates::kValid_s, OwnCertificates::kBefore_s + OwnCertificates::kShown_s + kDay_s);
}

TEST(QuicOwnCertificates, tell_the_next_hash_a_day_before_they_change) {
  OwnCertificates own = OwnCertificates::make(kNow_s).value();
  const auto first = own.current();
  EXPECT_THAT(own.hashes(), testing::ElementsAre(first->hash()));
  std::vector<CertificateHash> announced;
  std::shared_ptr<const Credentials> shown = first;
  int changes = 0;
  // The server is polled every hour for 60 days, and each certificate is shown for 9 or 10 days.
  for (std::int64_t now_s = kNow_s; now_s < kNow_s + 60 * kDay_s; now_s += 3600) {
    ASSERT_TRUE(own.poll(now_s));
    EXPECT_LE(own.hashes().size(), 2u);
    if (own.current() != shown) {
      ++changes;
      // The hash of the new certificate was announced an hour ago, so clients that have read it can connect.
      EXPECT_THAT(announced, testing::Contains(own.current()->hash()));
      shown = own.current();
    }
    announced = own.hashes();
    EXPECT_THAT(announced, testing::Contains(shown->hash()));
  }
  EXPECT_EQ(changes, 6);
}

TEST(QuicOwnCertificates, are_made_anew_when_the_clock_jumps) {
  // A machine may start with a wrong clock, which is then set forwards or back by more than a certificate is valid.
  for (const std::int64_t jump_s : {-400 * kDay_s, 400 * kDay_s}) {
    OwnCertificates own = OwnCertificates::make(kNow_s).value();
    const auto before = own.current();
    ASSERT_TRUE(own.poll(kNow_s + jump_s));
    EXPECT_NE(own.current(), before);
    const auto after = own.current();
    ASSERT_TRUE(own.poll(kNow_s + jump_s + 60));
    EXPECT_EQ(own.current(), after);
  }
}

TEST(QuicCredentials, name_the_file_that_cannot_be_used) {
  const auto loaded = Credentials::load("/nowhere/chain.pem", "/nowhere/key.pem");
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error(), testing::HasSubstr("/nowhere/chain.pem"));
}

std::vector<std::uint8_t> peeked(const SendBuffer& buffer) {
  std::array<ngtcp2_vec, 4> pieces{};
  std::vector<std::uint8_t> bytes;
  const std::size_t count = buffer.peek(pieces);
  for (std::size_t i = 0; i < count; ++i) bytes.insert(bytes.end(), pieces[i].base, pieces[i].base + pieces[i].len);
  return bytes;
}

TEST(QuicSendBuffer, gives_each_byte_once_and_keeps_it_until_it_is_acknowledged) {
  SendBuffer buffer;
  buffer.push({1, 2, 3});
  buffer.push({4, 5});
  EXPECT_EQ(peeked(buffer), (std::vector<std::uint8_t>{1, 2, 3, 4, 5}));
  buffer.mark_sent(2, false);
  EXPECT_EQ(peeked(buffer), (std::vector<std::uint8_t>{3, 4, 5}));
  buffer.mark_sent(2, false);
  EXPECT_EQ(peeked(buffer), (std::vector<std::uint8_t>{5}));
  EXPECT_EQ(buffer.kept_bytes(), 5u);
  buffer.acknowledge(2);
  // Two of the three bytes of the first piece are acknowledged, and a piece is freed as a whole.
  EXPECT_EQ(buffer.kept_bytes(), 5u);
  buffer.acknowledge(4);
  EXPECT_EQ(buffer.kept_bytes(), 2u);
  EXPECT_EQ(peeked(buffer), (std::vector<std::uint8_t>{5}));
  buffer.push({6});
  buffer.end();
  buffer.mark_sent(2, true);
  EXPECT_FALSE(buffer.has_unsent());
  EXPECT_FALSE(buffer.is_done());
  buffer.acknowledge(6);
  EXPECT_TRUE(buffer.is_done());
}

TEST(QuicSendBuffer, of_a_stream_that_was_reset_keeps_what_was_sent_in_its_place) {
  // QUIC may repeat the bytes that it has been given, also after the reset, so those 15 must stay where they are.
  SendBuffer buffer;
  buffer.push(Bytes(10, 1));
  buffer.push(Bytes(10, 2));
  buffer.push(Bytes(10, 3));
  std::array<ngtcp2_vec, 3> pieces{};
  ASSERT_EQ(buffer.peek(pieces), 3u);
  buffer.mark_sent(15, false);
  buffer.reset();
  EXPECT_FALSE(buffer.has_unsent());
  EXPECT_EQ(buffer.unsent_bytes(), 0u);
  EXPECT_TRUE(buffer.is_done());
  EXPECT_EQ(pieces[0].base[9], 1);
  EXPECT_EQ(pieces[1].base[4], 2);
  buffer.push(Bytes(10, 4));
  buffer.end();
  EXPECT_FALSE(buffer.has_unsent());
  buffer.acknowledge(15);
  EXPECT_EQ(buffer.kept_bytes(), 0u);
}

TEST(QuicSendBuffer, sends_an_end_without_bytes) {
  SendBuffer buffer;
  EXPECT_FALSE(buffer.has_unsent());
  buffer.end();
  EXPECT_TRUE(buffer.has_unsent());
  EXPECT_TRUE(buffer.reaches_end({}));
  buffer.mark_sent(0, true);
  EXPECT_TRUE(buffer.is_done());
}

TEST(QuicOutgoing, joins_packets_of_one_path_and_size_and_ends_a_burst_at_a_shorter_one) {
  // Each burst has its bytes and the size of its segments, all of which but the last are equally large.
  std::vector<std::pair<std::size_t, std::size_t>> bursts;
  Outgoing out([&](std::span<const Burst> all) {
    for (const Burst& burst : all) bursts.emplace_back(burst.bytes.size(), burst.segment_bytes);
  });
  const Path a{loopback(1), loopback(2)}, b{loopback(1), loopback(3)};
  for (const auto& [path, bytes] :
       std::vector<std::pair<Path, std::size_t>>{{a, 1000}, {a, 1000}, {a, 500}, {a, 500}, {b, 500}, {b, 600}}) {
    EXPECT_GE(out.room().size(), bytes);
    out.add(path, bytes, 0);
  }
  out.flush();
  EXPECT_THAT(bursts, testing::ElementsAre(std::pair(2500, 1000), std::pair(500, 500), std::pair(500, 500),
                                           std::pair(600, 600)));
}

TEST(QuicOutgoing, hands_over_what_does_not_fit_and_bounds_a_burst) {
  std::size_t packets = 0, calls = 0;
  Outgoing out([&](std::span<const Burst> all) {
    ++calls;
    for (const Burst& burst : all) {
      const std::size_t count = (burst.bytes.size() + burst.segment_bytes - 1) / burst.segment_bytes;
      EXPECT_LE(count, Outgoing::kBurstPacketsMax);
      EXPECT_LE(burst.bytes.size(), Outgoing::kBurstBytesMax);
      packets += count;
    }
  });
  for (int n = 0; n < 1000; ++n) {
    out.room();
    out.add({loopback(1), loopback(2)}, 1452, 0);
  }
  out.flush();
  out.flush();
  EXPECT_EQ(packets, 1000u);
  EXPECT_GT(calls, 1u);
}

TEST(QuicAddress, is_shown_and_compared_with_its_port) {
  EXPECT_EQ(loopback(7420).text(), "127.0.0.1:7420");
  EXPECT_EQ(loopback(7420), loopback(7420));
  EXPECT_NE(loopback(7420), loopback(7421));
  EXPECT_NE(loopback(7420), loopback(7420, 2));
  EXPECT_EQ(Address().text(), "none");
}

}  // namespace
}  // namespace hairnet::quic
