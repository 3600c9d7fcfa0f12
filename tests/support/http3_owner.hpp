#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/http3/connection.hpp"

namespace hairnet::http3 {

// Stands in for the QUIC connection below a server's http3::Connection (its header says what each call means), and
// stores every call for the test.
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

  // The status that answers every request. A test sets another one to refuse the session.
  int status = 200;
  // The number of all calls, so that a test can expect that nothing has happened.
  std::size_t calls = 0;
  // By stream: all bytes that the connection has sent there.
  std::map<StreamId, Bytes> sent;
  // The streams that the connection has ended.
  std::set<StreamId> ended;
  // The streams that the connection has stopped reading or has reset, with the error code of each.
  std::map<StreamId, ErrorCode> stopped, resets;
  // The code of the last call of fail().
  std::optional<ErrorCode> failure;
  // The numbers of calls of fail() and of on_session_end().
  int failures = 0, ends = 0;
  std::vector<Request> requests;
  // The stream of the session's channel, once it is open.
  std::optional<StreamId> channel;
  // All bytes of the channel.
  Bytes received;
  std::vector<Bytes> datagrams;
};

}  // namespace hairnet::http3
