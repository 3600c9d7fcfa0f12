#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "core/result.hpp"
#include "server/objects/http_exchange.hpp"

namespace hairnet::server {

struct BlockingHttpClientDef {
  // A name or a numeric address, without brackets.
  std::string host;
  std::uint16_t port = 0;
  bool is_tls = false;
  // The PEM file of the server's authority; empty: those of the system.
  std::string ca = {};
  // Names the server in errors.
  std::string whose = "the server";
  // Includes TLS, but not finding the addresses of a name, which the system bounds.
  std::chrono::milliseconds connect_timeout{2'000};
  // A request and its answer may take this long, and mib_timeout more for each MiB of them.
  std::chrono::milliseconds exchange_timeout{10'000};
  std::chrono::milliseconds mib_timeout{1'000};
};

// Carries requests over HTTP/1.1 while its caller waits: call() runs an event loop of the client's own. The connection
// is kept for the next request.
class BlockingHttpClient final : public HttpExchange {
 public:
  // Reads the file of certificates; the error is one line.
  static Result<std::unique_ptr<BlockingHttpClient>> create(const BlockingHttpClientDef& def);
  ~BlockingHttpClient() override;
  BlockingHttpClient(const BlockingHttpClient&) = delete;
  BlockingHttpClient& operator=(const BlockingHttpClient&) = delete;

  ExchangeAnswer call(const ExchangeRequest& request, std::size_t body_bytes_max) override;
  void cancel() override;

 private:
  struct Impl;
  explicit BlockingHttpClient(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet::server
