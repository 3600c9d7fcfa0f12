#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>

#include "server/objects/http_exchange.hpp"
#include "server/objects/object_counters.hpp"
#include "server/objects/object_store.hpp"
#include "server/objects/s3_signature.hpp"

namespace hairnet::server {

struct S3StoreDef {
  // The log names the store by it.
  std::string url;
  // Is as the field Host has it: with the port, unless that is the scheme's own.
  std::string host;
  // Comes before the name of each object; begins and ends with a slash.
  std::string path;
  std::string region;
  S3Keys keys;
  // Dates signatures, which are valid for some minutes.
  std::function<std::int64_t()> unix_time_s;
  // Is monotonic.
  std::function<std::int64_t()> now_ns;
  // The store is left alone for this long after a failure.
  std::int64_t pause_ns = 10'000'000'000;
};

// Objects in a bucket of S3, or of what speaks its protocol. After a call without a proper answer the store is left
// alone for a while, so that a dead one delays a call now and then, and not each; a refused put does not keep gets from
// being tried. The log has a line when that begins, when its reason changes and when it ends.
class S3Store final : public ObjectStore {
 public:
  // The exchange and the counters must outlive it.
  S3Store(S3StoreDef def, HttpExchange& exchange, ObjectCounters& counters);

  ObjectAnswer get(std::string_view name, std::size_t bytes_max) override;
  ObjectAnswer put(std::string_view name, std::span<const std::uint8_t> bytes, Existing existing) override;
  [[nodiscard]] bool takes_gets() const override { return is_open(all_) && is_open(gets_); }
  [[nodiscard]] bool takes_puts() const override { return is_open(all_) && is_open(puts_); }
  void cancel() override;

 private:
  // Calls that fail together.
  struct Calls {
    const char* name;                           // for the log
    std::atomic<std::int64_t> closed_until_ns;  // not made until then
    std::string failure = {};                   // as the log knows it; empty: none
  };

  [[nodiscard]] bool is_open(const Calls& calls) const;
  ExchangeAnswer call(ExchangeRequest::Method method, std::string_view name, std::span<const std::uint8_t> body,
                      std::size_t bytes_max);
  // The answer to a call that has brought none of the good ones.
  ObjectAnswer fail(Calls& calls, const ExchangeAnswer& answer);
  ObjectAnswer skip();
  void close(Calls& calls, const std::string& reason, const std::string& detail);
  void succeed(Calls& calls);

  S3StoreDef def_;
  HttpExchange* exchange_;
  ObjectCounters* counters_;
  std::mutex mutex_;  // one call at a time
  std::atomic<bool> cancelled_{false};
  Calls all_{"all", 0}, gets_{"get", 0}, puts_{"put", 0};
};

}  // namespace hairnet::server
