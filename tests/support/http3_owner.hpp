#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/http3/connection.hpp"

namespace hairnet::http3 {

// Stores what a Connection asks for and tells.
class RecordingOwner final : public Owner {
 public:
  void send(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) override {
    ++calls;
    Bytes& all = sent[stream];
    all.insert(all.end(), bytes.begin(), bytes.end());
    if (is_last) ended.insert(stream);
  }
  void stop_reading(StreamId stream, ErrorCode code) override {
    ++calls;
    stopped.emplace(stream, code);
  }
  void reset(StreamId stream, ErrorCode code) override {
    ++calls;
    resets.emplace(stream, code);
  }
  void fail(ErrorCode code, std::string_view) override {
    ++calls;
    ++failures;
    failure = code;
  }
  int on_request(const Request& asked) override {
    ++calls;
    requests.push_back(asked);
    return status;
  }
  void on_channel_open(StreamId stream) override {
    ++calls;
    channel = stream;
  }
  void on_channel_bytes(std::span<const std::uint8_t> bytes) override {
    ++calls;
    received.insert(received.end(), bytes.begin(), bytes.end());
  }
  void on_datagram(std::span<const std::uint8_t> bytes) override {
    ++calls;
    datagrams.emplace_back(bytes.begin(), bytes.end());
  }
  void on_session_end() override {
    ++calls;
    ++ends;
  }

  // Answers every request.
  int status = 200;
  std::size_t calls = 0;
  std::map<StreamId, Bytes> sent;
  std::set<StreamId> ended;
  std::map<StreamId, ErrorCode> stopped, resets;
  std::optional<ErrorCode> failure;
  int failures = 0, ends = 0;
  std::vector<Request> requests;
  std::optional<StreamId> channel;
  Bytes received;
  std::vector<Bytes> datagrams;
};

}  // namespace hairnet::http3
