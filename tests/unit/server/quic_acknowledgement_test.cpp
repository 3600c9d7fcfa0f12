#include <ngtcp2/ngtcp2_crypto.h>

#include <algorithm>

#include "tests/unit/server/quic_fixture.hpp"

namespace {

// Changes the frames of each packet before it is encrypted. Empty: packets stay as they are.
std::function<void(std::span<std::uint8_t> frames)> alter_frames;

}  // namespace

// Takes the place of the library's: both ends encrypt with it.
extern "C" int ngtcp2_crypto_encrypt_cb(std::uint8_t* to, const ngtcp2_crypto_aead* aead,
                                        const ngtcp2_crypto_aead_ctx* context, const std::uint8_t* frames,
                                        std::size_t frame_bytes, const std::uint8_t* nonce, std::size_t nonce_bytes,
                                        const std::uint8_t* header, std::size_t header_bytes) {
  std::vector<std::uint8_t> altered(frames, frames + frame_bytes);
  if (alter_frames) alter_frames(altered);
  const int error =
      ngtcp2_crypto_encrypt(to, aead, context, altered.data(), frame_bytes, nonce, nonce_bytes, header, header_bytes);
  return error == 0 ? 0 : NGTCP2_ERR_CALLBACK_FAILURE;
}

namespace hairnet::quic {
namespace {

// An ACK frame at the begin of a packet, whose numbers take a byte each but for the delay. Empty: there is none.
std::span<std::uint8_t> first_acknowledgement(std::span<std::uint8_t> frames) {
  constexpr std::uint8_t kAcknowledgement = 0x02;
  if (frames.size() < 5 || frames[0] != kAcknowledgement) return {};
  std::size_t at = 1;
  const auto skip = [&] { at += std::size_t{1} << (frames[at] >> 6); };
  skip();  // the largest number
  skip();  // the delay
  const std::size_t ranges = frames[at] & 0x3f;
  skip();
  for (std::size_t n = 0; n < 1 + 2 * ranges; ++n) skip();
  return frames.first(at);
}

class QuicAcknowledgement : public testing::Test {
 protected:
  ~QuicAcknowledgement() override { alter_frames = nullptr; }
  // Exchanges packets for a while; those of the client are altered.
  void run(QuicClient& client, int turns, const std::function<void(std::span<std::uint8_t>)>& alter) {
    for (int turn = 0; turn < turns; ++turn) {
      client.poll(network_.now_ns);
      alter_frames = alter;
      const std::vector<Bytes> packets = client.write(network_.now_ns);
      alter_frames = nullptr;
      for (const Bytes& packet : packets)
        network_.endpoint.receive({client.path().remote, client.path().local}, 0, packet, network_.now_ns);
      network_.endpoint.flush(network_.now_ns);
      for (auto& [to, packet] : std::exchange(network_.in_flight, {})) client.receive(packet, network_.now_ns);
      network_.now_ns += 5'000'000;
    }
  }
  QuicNetwork network_;
};

TEST_F(QuicAcknowledgement, of_packets_that_were_never_sent_ends_the_connection_as_a_violation) {
  auto [client, channel] = network_.join();
  int forged = 0;
  network_.connections[0]->send({1});
  run(client, 20, [&](std::span<std::uint8_t> frames) {
    const std::span<std::uint8_t> frame = first_acknowledgement(frames);
    if (frame.empty() || forged > 0 || frame[1] >= 0x3f) return;
    // The server has sent fewer than 63 packets, so the frame now acknowledges one that does not exist.
    frame[1] = 0x3f;
    ++forged;
  });
  ASSERT_EQ(forged, 1);
  EXPECT_EQ(client.error(), NGTCP2_ERR_DRAINING);
  EXPECT_EQ(client.close_error().type, NGTCP2_CONNECTION_CLOSE_ERROR_CODE_TYPE_TRANSPORT);
  EXPECT_EQ(client.close_error().error_code, std::uint64_t{NGTCP2_PROTOCOL_VIOLATION});
  EXPECT_EQ(network_.counters.closed_quic_error.value(), 1u);
  EXPECT_THAT(network_.sinks[0]->closed, testing::ElementsAre("the QUIC connection broke"));
  network_.run(2);
  EXPECT_EQ(network_.endpoint.connection_count(), 0u);
}

TEST_F(QuicAcknowledgement, that_never_comes_lets_a_bounded_number_of_bytes_wait_and_leave) {
  auto [client, channel] = network_.join();
  network_.run(0.5);
  int removed = 0;
  const auto remove = [&](std::span<std::uint8_t> frames) {
    const std::span<std::uint8_t> frame = first_acknowledgement(frames);
    std::ranges::fill(frame, std::uint8_t{0});  // padding
    removed += !frame.empty();
  };
  Connection& connection = *network_.connections[0];
  const std::size_t before = network_.server_bytes;
  std::size_t taken = 0;
  // Each turn lasts 5 ms: 20 s pass, and the client sends a byte ten times in each second.
  for (int n = 0; n < 4000; ++n) {
    for (int k = 0; k < 10 && connection.is_writable(); ++k, ++taken) connection.send(Bytes(1000));
    if (n % 20 == 0) client.send(channel, Bytes{1});
    run(client, 1, remove);
  }
  EXPECT_GT(removed, 5);
  EXPECT_LE(connection.unsent_bytes(), Connection::kUnsentBytesMax + 1000);
  EXPECT_LT(1000 * taken, Connection::kKeptBytesMax);
  EXPECT_LT(network_.server_bytes - before, std::size_t{256} << 10) << "the window, and probes ever more rarely";
  EXPECT_EQ(network_.sinks[0]->received.size(), 200u);
}

}  // namespace
}  // namespace hairnet::quic
