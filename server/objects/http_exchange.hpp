#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hairnet::server {

// One request. The body must stay valid until call() returns.
struct ExchangeRequest {
  enum class Method : std::uint8_t { get, head, put };
  Method method = Method::get;
  // The path as the request line has it, encoded.
  std::string target;
  // The fields of the header, beside those that every request has.
  std::vector<std::pair<std::string, std::string>> fields = {};
  std::span<const std::uint8_t> body = {};
};

// Why a request has no answer. Unreachable: no connection. Timeout: it took too long. Broken: the connection ended
// early. Malformed: not HTTP. Oversize: more than was asked for. Cancelled: cancel() was called.
enum class ExchangeError : std::uint8_t { none, unreachable, timeout, broken, malformed, oversize, cancelled };

struct ExchangeAnswer {
  ExchangeError error = ExchangeError::none;
  // Describes the error in one line.
  std::string detail;
  // The status of the answer; zero: there is none.
  unsigned status = 0;
  std::vector<std::uint8_t> body;
};

// Carries one request to a fixed server and waits for its answer, no longer than its time-outs.
class HttpExchange {
 public:
  virtual ~HttpExchange() = default;
  // The body of a get with status 200 has at most `body_bytes_max`, any other one 64 KiB; else oversize, with the
  // status. One thread at a time.
  [[nodiscard]] virtual ExchangeAnswer call(const ExchangeRequest& request, std::size_t body_bytes_max) = 0;
  // Ends the call under way soon, and every later one at once. Any thread.
  virtual void cancel() = 0;
};

}  // namespace hairnet::server
