#pragma once

#include <memory>

#include "core/result.hpp"
#include "server/fleet/etcd_transport.hpp"
#include "server/transport/etcd_endpoint.hpp"
#include "server/transport/io_loop.hpp"

namespace hairnet::server {

// Carries a directory's calls to etcd over HTTP/1.1, plain or inside TLS. A few connections to each endpoint are kept
// for the next call. The directory decides when a call has taken too long; here each has bounds in bytes and an outer
// time-out. I/O thread.
class EtcdClient final : public EtcdTransport {
 public:
  // Reads the files of certificates and the password; the error is one line. The loop must outlive the client's calls.
  static Result<std::unique_ptr<EtcdClient>> create(IoLoop& loop, const EtcdOptions& options);
  ~EtcdClient() override;
  EtcdClient(const EtcdClient&) = delete;
  EtcdClient& operator=(const EtcdClient&) = delete;

  // Before the first call. The sink must outlive the client, or be null by then.
  void set_sink(EtcdSink* sink);
  void send(EtcdCall call) override;
  void cancel(std::uint64_t call) override;

 private:
  struct Impl;
  explicit EtcdClient(std::shared_ptr<Impl> impl);
  std::shared_ptr<Impl> impl_;
};

}  // namespace hairnet::server
