#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/session/connection.hpp"

namespace hairnet::server {

// A fake connection that stores the sent packets, decoded.
class FakeConnection final : public Connection {
 public:
  void mark_joined() override { joined = true; }
  void send(std::vector<std::uint8_t> packet) override {
    wire::DecodedPacket decoded = wire::decode_packet(packet);
    if (room) --*room;
    valid &= decoded.error == wire::DecodeError::none;
    largest_packet_bytes = std::max(largest_packet_bytes, packet.size());
    received.push_back(std::move(decoded.envelope));
  }
  [[nodiscard]] double bytes_per_s() const override { return network_bytes_per_s; }
  [[nodiscard]] bool writable() const override { return is_writable && room != 0; }
  [[nodiscard]] bool has_download_streams() const override { return has_streams; }
  std::optional<DownloadStream> open_download() override {
    if (streams_left == 0) return std::nullopt;
    --streams_left;
    downloads[++last_stream] = {};
    return last_stream;
  }
  [[nodiscard]] bool takes_more(DownloadStream stream) const override {
    const auto found = downloads.find(stream);
    return found != downloads.end() && found->second.room > 0;
  }
  void send_download(DownloadStream stream, std::vector<std::uint8_t> packet, bool is_last) override {
    Download& download = downloads.at(stream);
    wire::DecodedPacket decoded = wire::decode_packet(packet);
    valid &= takes_more(stream) && !download.is_ended && decoded.error == wire::DecodeError::none;
    --download.room;
    download.is_ended = is_last;
    download.pieces.push_back(std::get<wire::GroomData>(decoded.envelope.message));
  }
  void reset_download(DownloadStream stream) override { downloads.at(stream).was_reset = true; }
  void close(std::string_view reason) override {
    closed = true;
    close_reason = reason;
  }
  [[nodiscard]] std::string_view peer() const override { return "nowhere"; }
  [[nodiscard]] std::string_view network() const override { return address; }

  // The messages of one kind, in order; they stay.
  template <class T>
  [[nodiscard]] std::vector<T> all() const {
    std::vector<T> found;
    for (const wire::Envelope& envelope : received) {
      if (const T* message = std::get_if<T>(&envelope.message)) found.push_back(*message);
    }
    return found;
  }

  struct Download {
    // The stream takes this many packets more.
    std::size_t room = 2;
    std::vector<wire::GroomData> pieces;
    bool is_ended = false, was_reset = false;
    [[nodiscard]] std::size_t bytes() const {
      std::size_t sum = 0;
      for (const wire::GroomData& piece : pieces) sum += piece.bytes.size();
      return sum;
    }
  };
  bool has_streams = false;
  std::size_t streams_left = 100;
  DownloadStream last_stream = 0;
  std::map<DownloadStream, Download> downloads;
  // The connection takes this many packets more; none means any number.
  std::optional<std::size_t> room;
  std::deque<wire::Envelope> received;
  std::size_t largest_packet_bytes = 0;
  double network_bytes_per_s = 0;
  bool is_writable = true, joined = false, closed = false, valid = true;
  std::string close_reason, address;
};

}  // namespace hairnet::server
