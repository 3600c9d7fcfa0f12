#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/link/webtransport/http3_session.hpp"

namespace hairnet::link {

// Stores what a Http3Session asks for and tells.
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

  bool allows_no_streams = false;
  std::size_t calls = 0;
  std::map<StreamId, http3::Bytes> sent;
  std::set<StreamId> stopped;
  std::optional<http3::ErrorCode> failure;
  std::string error;
  int failures = 0, channels = 0, ends = 0;
  http3::Bytes received;
  std::vector<http3::Bytes> datagrams;
  std::map<StreamId, http3::Bytes> downloads;
  std::set<StreamId> downloads_ended, downloads_reset;

 private:
  StreamId next_one_way_ = 2, next_both_ways_ = 0;
};

}  // namespace hairnet::link
