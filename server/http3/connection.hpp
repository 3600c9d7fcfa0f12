#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string_view>

#include "schema/http3/error_code.hpp"
#include "schema/http3/frame_reader.hpp"
#include "schema/http3/varint.hpp"
#include "server/http3/request.hpp"

namespace hairnet::http3 {

// A QUIC stream. Its lowest bit says who opened it (0: the client), the next one whether it is unidirectional.
using StreamId = std::int64_t;

// What a Connection asks of the QUIC connection below it, and tells the one above. No call may destroy the Connection.
class Owner {
 public:
  virtual ~Owner() = default;
  // Queues bytes on the stream. `is_last`: the stream ends behind them.
  virtual void send(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last) = 0;
  // Asks the peer to send no more on the stream.
  virtual void stop_reading(StreamId stream, ErrorCode code) = 0;
  // Sends no more on the stream, and drops what waits there.
  virtual void reset(StreamId stream, ErrorCode code) = 0;
  // The peer broke the protocol: the QUIC connection has to end. Nothing follows.
  virtual void fail(ErrorCode code, std::string_view error) = 0;
  // The peer asks for a session. Returns the response's status: 200 opens it.
  virtual int on_request(const Request& request) = 0;
  // The session's first bidirectional stream has come; later ones are rejected.
  virtual void on_channel_open(StreamId stream) = 0;
  // Bytes of the channel, in order, and the payload of one datagram of the session. The spans are valid during the
  // call.
  virtual void on_channel_bytes(std::span<const std::uint8_t> bytes) = 0;
  virtual void on_datagram(std::span<const std::uint8_t> bytes) = 0;
  // The peer has ended the session or its channel; once.
  virtual void on_session_end() = 0;
};

// What became of a datagram: passed on; dropped because there is no session yet or any more; dropped as another
// session's; not valid, which ends the connection.
enum class DatagramFate : std::uint8_t { delivered, no_session, other_session, malformed };

// The server's side of HTTP/3, as far as one WebTransport session needs it: an extended CONNECT opens the session,
// whose datagrams and first bidirectional stream, its channel, are passed on. Other requests are refused, and the
// session's other streams are rejected. No I/O. One thread. It keeps a state for each open stream of the peer, whose
// number QUIC bounds, and stores bytes only of a stream's type, settings and fields, each bounded. It does not serve
// requests for pages, and opens no second session, because clients need one each.
class Connection {
 public:
  explicit Connection(Owner& owner) : owner_(&owner) {}

  // `stream` is a unidirectional stream that the server has opened. It becomes the control stream.
  void start(StreamId stream);
  // Bytes of a stream in order. `is_last`: the stream ends behind them.
  void on_bytes(StreamId stream, std::span<const std::uint8_t> bytes, bool is_last);
  // The peer sends no more on the stream.
  void on_reset(StreamId stream);
  // The peer reads no more of the stream.
  void on_stop(StreamId stream);
  // The stream has ended in both directions, and its number is forgotten.
  void on_stream_closed(StreamId stream);
  DatagramFate on_datagram(std::span<const std::uint8_t> bytes);

  // The bytes with which each datagram of the session begins. Asserts that there is a session.
  [[nodiscard]] Bytes datagram_prefix() const;
  // The bytes with which a unidirectional stream of the session begins that the server opens. Asserts that there is a
  // session.
  [[nodiscard]] Bytes one_way_begin() const;
  [[nodiscard]] bool has_session() const { return session_.has_value(); }
  [[nodiscard]] std::optional<StreamId> channel() const { return channel_; }
  // Ends the session, with a code and one line for the peer. Without a session nothing happens.
  void close_session(std::uint32_t code, std::string_view reason);
  // Tests check with it that a peer cannot make the connection store much.
  [[nodiscard]] std::size_t buffered_bytes() const;

 private:
  // The kinds of streams that a client opens. `encoder` and `decoder` are those of QPACK; `request` has not opened a
  // session (yet); nothing of `ignored` is read.
  enum class Kind : std::uint8_t { unknown, control, encoder, decoder, request, session, channel, ignored };
  struct Stream {
    Kind kind = Kind::unknown;
    // Gathers its type, or a frame that is needed as a whole.
    Bytes begin;
    FrameReader frames, capsules;
    // The settings have come, on the control stream.
    bool has_settings = false;
    // The fields have come, on the stream of a request.
    bool has_fields = false;
  };

  // Reads the stream's type, and returns the bytes behind it.
  std::span<const std::uint8_t> take_type(StreamId id, Stream& stream, std::span<const std::uint8_t> bytes);
  // Reads the number of the session behind the signal of a WebTransport stream, and decides what becomes of the stream.
  std::span<const std::uint8_t> take_session_signal(StreamId id, Stream& stream, const Varint& signal,
                                                    std::span<const std::uint8_t> bytes);
  // Handles bytes of a stream whose kind is known.
  void take_bytes(StreamId id, Stream& stream, std::span<const std::uint8_t> bytes);
  // The next four handle a piece of a frame or capsule, or a whole section of fields. They return false when the stream
  // or the connection accepts nothing more.
  bool take_control(Stream& stream, const FrameReader::Piece& piece);
  bool take_request(StreamId id, Stream& stream, const FrameReader::Piece& piece);
  bool take_fields(StreamId id, Stream& stream);
  bool take_capsule(const FrameReader::Piece& piece);
  // The peer has ended its side of the stream.
  void take_end(StreamId id, Stream& stream);
  // Sends the response. Only a response of 200 leaves the stream open, as the session's.
  void respond(StreamId id, int status);
  // Refuses one stream; the connection goes on.
  void reject(StreamId id, Stream& stream, ErrorCode code);
  // Tells the owner of the first failure only. Returns false, so that callers can return it.
  bool fail(ErrorCode code, std::string_view error);
  // Tells the owner that the peer has ended the session, unless it has ended already.
  void end_session();

  Owner* owner_;
  std::map<StreamId, Stream> streams_;
  // session_ is the stream of the session's CONNECT, and channel_ its first bidirectional stream.
  std::optional<StreamId> session_, channel_;
  // has_failed_: fail() was called. The others: the client's control stream, or that QPACK stream of its, has begun.
  bool has_failed_ = false, has_control_ = false, has_encoder_ = false, has_decoder_ = false;
  // on_session_end() or close_session() was called, and neither follows again.
  bool session_ended_ = false;
};

}  // namespace hairnet::http3
