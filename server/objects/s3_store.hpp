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
  // The host as the header field Host has it: with the port, unless that is the scheme's own.
  std::string host;
  // Comes before the name of each object; begins and ends with a slash.
  std::string path;
  std::string region;
  S3Keys keys;
  // Dates signatures, which are valid for some minutes.
  std::function<std::int64_t()> unix_time_s;
  // A monotonic clock.
  std::function<std::int64_t()> now_ns;
  // The store is left alone for this long after a failure.
  std::int64_t pause_ns = 10'000'000'000;
};

// Objects in a bucket of S3, or of what speaks its protocol. After a call without a proper answer the store is left
// alone for a while, so that a dead one delays a call now and then, and not each; a refused put does not keep gets from
// being tried. The log has a line when that begins, when its reason changes and when it ends.
class S3Store final : public ObjectStore {
 public:
  // `exchange` and `counters` must outlive the store.
  S3Store(S3StoreDef def, HttpExchange& exchange, ObjectCounters& counters);

  ObjectAnswer get(std::string_view name, std::size_t bytes_max) override;
  ObjectAnswer put(std::string_view name, std::span<const std::uint8_t> bytes, Existing existing) override;
  [[nodiscard]] bool takes_gets() const override { return is_open(all_) && is_open(gets_); }
  [[nodiscard]] bool takes_puts() const override { return is_open(all_) && is_open(puts_); }
  void cancel() override;

 private:
  // Calls that fail together.
  struct Calls {
    // The log names the calls by it.
    const char* name;
    // The calls are not made until this time. Any thread reads it without the lock.
    std::atomic<std::int64_t> closed_until_ns;
    // The reason that the log has; empty: the calls work.
    std::string failure = {};
  };

  [[nodiscard]] bool is_open(const Calls& calls) const;
  ExchangeAnswer call(ExchangeRequest::Method method, std::string_view name, std::span<const std::uint8_t> body,
                      std::size_t bytes_max);
  // Returns the answer to a call that has failed, counts it by reason, and closes the calls.
  ObjectAnswer fail(Calls& calls, const ExchangeAnswer& answer);
  // Returns the answer to a call that is not made, and counts it.
  ObjectAnswer skip();
  // Leaves these calls alone for pause_ns, and logs the reason if it is new.
  void close(Calls& calls, const std::string& reason, const std::string& detail);
  // The store has answered as it should: ends the failure of these calls, and of all.
  void succeed(Calls& calls);

  S3StoreDef def_;
  HttpExchange* exchange_;
  ObjectCounters* counters_;
  // Locked during a call, because the exchange takes one at a time. A call may wait for its turn behind another one's
  // time-outs.
  std::mutex mutex_;
  std::atomic<bool> cancelled_{false};
  // A store that does not answer closes all calls for a while. A store that refuses closes only gets or only puts,
  // since an operator's key may allow only one of the two.
  Calls all_{"all", 0}, gets_{"get", 0}, puts_{"put", 0};
};

}  // namespace hairnet::server
