#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace hairnet::server {

// One request to etcd's JSON gateway: a POST.
struct EtcdCall {
  std::uint64_t id = 0;
  // An index into the configured endpoints.
  std::size_t endpoint = 0;
  std::string path, body;
  // The answer is a line of JSON for each message, without an end.
  bool is_stream = false;
};

// Why a call has failed. After the first three the endpoint may be out of reach; with the others the endpoint has
// answered, but the answer cannot be used.
enum class EtcdError : std::uint8_t { unreachable, timeout, broken, refused, malformed, oversize };

// Takes what the transport receives. I/O thread.
class EtcdSink {
 public:
  virtual ~EtcdSink() = default;
  // The whole answer of a call; of a stream only when its status is not 200.
  virtual void on_answer(std::uint64_t call, int status, std::string_view body, std::int64_t now_ns) = 0;
  // One line of a stream.
  virtual void on_line(std::uint64_t call, std::string_view line, std::int64_t now_ns) = 0;
  // The call has failed, or the stream has ended.
  virtual void on_error(std::uint64_t call, EtcdError error, std::int64_t now_ns) = 0;
};

// Carries calls to etcd. An implementation calls the sink later, never inside send() or cancel(), so that the caller's
// state does not change during these calls. Tests have a simulated transport.
class EtcdTransport {
 public:
  virtual ~EtcdTransport() = default;
  virtual void send(EtcdCall call) = 0;
  // The sink gets nothing more of this call. etcd may still execute it.
  virtual void cancel(std::uint64_t call) = 0;
};

}  // namespace hairnet::server
