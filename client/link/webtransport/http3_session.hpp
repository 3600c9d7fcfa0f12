#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "schema/http3/error_code.hpp"
#include "schema/http3/frame_reader.hpp"
#include "schema/http3/varint.hpp"

namespace hairnet::link {

// QUIC's number of a stream. The lowest bit says who opened it (0: the client), the next one whether it is one-way.
using StreamId = std::int64_t;

// What a Http3Session asks of the QUIC connection below it, and reports to the program above it. No call may destroy
// the session.
class Http3Owner {
 public:
  virtual ~Http3Owner() = default;
  // Returns -1 when the server allows no further stream.
  virtual StreamId open_stream(bool one_way) = 0;
  virtual void send(StreamId stream, http3::Bytes bytes) = 0;
  virtual void stop_reading(StreamId stream, http3::ErrorCode code) = 0;
  // The session is over: the server has ended it (no_error; `error` is its reason, or empty), or has broken the
  // protocol.
  virtual void fail(http3::ErrorCode code, std::string_view error) = 0;
  virtual void on_channel_open() = 0;
  virtual void on_channel_bytes(std::span<const std::uint8_t> bytes) = 0;
  // The server sends no more on the channel; the reason may follow in a call of fail().
  virtual void on_channel_end() = 0;
  // The bytes come on a one-way stream of the session. `is_last`: it ends behind them.
  virtual void on_download_bytes(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) = 0;
  // The server sends no more of that download.
  virtual void on_download_reset(StreamId stream) = 0;
  virtual void on_datagram(std::span<const std::uint8_t> bytes) = 0;
};

// The client's side of HTTP/3, as far as one WebTransport session needs it. It sends its settings, waits for the
// server's, sends an extended CONNECT, and opens the channel when the server accepts. The one-way streams of the
// session are downloads. Streams of other kinds, or of other sessions, are not read. No I/O, no time.
class Http3Session {
 public:
  Http3Session(Http3Owner& owner, std::string authority, std::string url_path)
      : owner_(&owner), authority_(std::move(authority)), url_path_(std::move(url_path)) {}

  // Call it when the QUIC connection is ready.
  void start();
  // Bytes of a stream in order. `is_last`: the stream ends behind them.
  void on_bytes(StreamId id, std::span<const std::uint8_t> bytes, bool is_last);
  // The server sends no more on the stream.
  void on_reset(StreamId id);
  // The server reads no more of the stream.
  void on_stop(StreamId id);
  void on_datagram(std::span<const std::uint8_t> bytes);

  // Returns the channel's stream; -1: the channel is not open.
  [[nodiscard]] StreamId channel() const { return channel_; }
  // Returns the bytes with which each datagram of the session begins. Asserts that the channel is open.
  [[nodiscard]] http3::Bytes datagram_prefix() const;

 private:
  // What a one-way stream of the server's turned out to be.
  enum class Kind : std::uint8_t { unknown, control, encoder, decoder, download, ignored };
  struct Stream {
    Kind kind = Kind::unknown;
    // Collects the stream's type and session, or its settings.
    http3::Bytes begin;
    http3::FrameReader frames;
    bool has_settings = false;
  };

  void take_one_way(StreamId id, std::span<const std::uint8_t> bytes, bool is_last);
  // Reads what the stream is, and returns the bytes behind that.
  std::span<const std::uint8_t> take_kind(StreamId id, Stream& stream, std::span<const std::uint8_t> bytes);
  void ignore(StreamId id, Stream& stream, http3::ErrorCode code);
  bool take_control(Stream& stream, const http3::FrameReader::Piece& piece);
  bool take_response(const http3::FrameReader::Piece& piece);
  bool take_capsule(const http3::FrameReader::Piece& piece);
  void request();
  void open_channel();
  // Always returns false, so that a caller can return its result.
  bool fail(http3::ErrorCode code, std::string_view error);

  Http3Owner* owner_;
  std::string authority_, url_path_;
  std::map<StreamId, Stream> one_way_;
  // session_ is the stream of the CONNECT, channel_ that of the packets; -1: not open yet.
  StreamId session_ = -1, channel_ = -1;
  // frames_ reads the session's stream as HTTP/3 frames, capsules_ the capsules inside them.
  http3::FrameReader frames_, capsules_;
  // Collects the bytes of a frame or a capsule of the session's stream that is read only when it is whole.
  http3::Bytes begin_;
  bool has_response_ = false, has_failed_ = false;
};

}  // namespace hairnet::link
