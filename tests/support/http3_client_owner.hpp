#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/link/webtransport/http3_session.hpp"

namespace hairnet::link {

// Stands in for the QUIC connection below a Http3Session (http3_session.hpp says what each call means), and stores
// every call for the test. Streams that it opens get the next numbers of their kind.
class RecordingHttp3Owner final : public Http3Owner {
 public:
  StreamId open_stream(bool one_way) override {
    ++calls;
    if (allows_no_streams) return -1;
    StreamId& next = one_way ? next_one_way_ : next_both_ways_;
    return std::exchange(next, next + 4);
  }
  void send(StreamId stream, http3::Bytes bytes) override {
    ++calls;
    http3::Bytes& all = sent[stream];
    all.insert(all.end(), bytes.begin(), bytes.end());
  }
  void stop_reading(StreamId stream, http3::ErrorCode) override {
    ++calls;
    stopped.insert(stream);
  }
  void fail(http3::ErrorCode code, std::string_view reason) override {
    ++calls;
    ++failures;
    failure = code;
    error = reason;
  }
  void on_channel_open() override {
    ++calls;
    ++channels;
  }
  void on_channel_bytes(std::span<const std::uint8_t> bytes) override {
    ++calls;
    received.insert(received.end(), bytes.begin(), bytes.end());
  }
  void on_channel_end() override {
    ++calls;
    ++ends;
  }
  void on_download_bytes(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) override {
    ++calls;
    http3::Bytes& all = downloads[stream];
    all.insert(all.end(), bytes.begin(), bytes.end());
    if (is_last) downloads_ended.insert(stream);
  }
  void on_download_reset(StreamId stream) override {
    ++calls;
    downloads_reset.insert(stream);
  }
  void on_datagram(std::span<const std::uint8_t> bytes) override {
    ++calls;
    datagrams.emplace_back(bytes.begin(), bytes.end());
  }

  // While set, open_stream() answers as a server that allows no further stream.
  bool allows_no_streams = false;
  // The number of all calls, so that a test can expect that nothing has happened.
  std::size_t calls = 0;
  // By stream: all bytes that the session has sent there.
  std::map<StreamId, http3::Bytes> sent;
  std::set<StreamId> stopped;
  // The arguments of the last call of fail().
  std::optional<http3::ErrorCode> failure;
  std::string error;
  // The numbers of calls of fail(), on_channel_open() and on_channel_end().
  int failures = 0, channels = 0, ends = 0;
  // All bytes of the channel.
  http3::Bytes received;
  std::vector<http3::Bytes> datagrams;
  // The bytes that came on each download's stream; the sets name the downloads that ended and those that were reset.
  std::map<StreamId, http3::Bytes> downloads;
  std::set<StreamId> downloads_ended, downloads_reset;

 private:
  // In QUIC the two low bits of a client's stream number are 00 for both ways and 10 for one way, so numbers of a
  // kind are 4 apart.
  StreamId next_one_way_ = 2, next_both_ways_ = 0;
};

}  // namespace hairnet::link
