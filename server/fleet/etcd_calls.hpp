#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "core/random.hpp"
#include "core/result.hpp"
#include "server/fleet/etcd_api.hpp"
#include "server/fleet/etcd_directory_def.hpp"
#include "server/fleet/etcd_transport.hpp"
#include "server/fleet/fleet_counters.hpp"

namespace hairnet::server {

// A request to etcd, and what its sender does when it ends. Exactly one of `on_answer` and `on_change` is set; the
// other callbacks may be empty.
struct EtcdCallDef {
  etcd::Request request;
  // The endpoint to ask; none: the one whose turn it is.
  std::optional<std::size_t> endpoint = {};
  // The call fails without an answer after this time; zero: after the time that the lease's length determines
  // (timeout_ns_).
  std::int64_t timeout_ns = 0;
  // Takes the answer. Returns false when it does not fit the request: then the call fails as malformed.
  std::function<bool(std::string_view body, std::int64_t now_ns)> on_answer = {};
  // Makes the call a watch without an end or a deadline. Takes each answer; returns false when etcd refuses the watch.
  std::function<bool(const etcd::WatchAnswer& answer, std::int64_t now_ns)> on_change = {};
  // The call has failed. etcd may have executed it, or may still do so.
  std::function<void(EtcdError error, std::int64_t now_ns)> on_failure = {};
  // etcd has answered that the lease of the request does not exist.
  std::function<void(std::int64_t now_ns)> on_lease_gone = {};
};

// Sends requests to etcd, each with a deadline, and gives each end to its sender. It turns to the next endpoint when
// one fails, and pauses when all have failed. It owns the calls under way and the choice of the endpoint. I/O thread.
class EtcdCalls {
 public:
  // `def`, `transport` and `counters` must outlive this object.
  EtcdCalls(const EtcdDirectoryDef& def, EtcdTransport& transport, FleetCounters& counters);

  // Returns the number of the call, which is never zero.
  std::uint64_t start(EtcdCallDef def, std::int64_t now_ns);
  // Cancels the call: none of its callbacks is called any more. Does nothing when the call is not under way.
  void stop(std::uint64_t id);
  void stop_all();
  // Lets the calls fail whose deadline has passed. Watches have no deadline.
  void end_overdue(std::int64_t now_ns);

  [[nodiscard]] bool is_under_way(std::uint64_t id) const { return calls_.contains(id); }
  [[nodiscard]] std::size_t count() const { return calls_.size(); }
  [[nodiscard]] bool is_full() const { return calls_.size() >= kCallsMax; }
  // False during the pause that follows when all endpoints have failed in turn.
  [[nodiscard]] bool may_start(std::int64_t now_ns) const { return now_ns >= retry_at_ns_; }
  // False once as many calls have failed in a row as there are endpoints.
  [[nodiscard]] bool is_reachable() const { return failures_ < def_->endpoint_count; }
  // The first endpoint from the current one on that is not in `silent`, which must not have all of them.
  [[nodiscard]] std::size_t next_endpoint(const std::set<std::size_t>& silent) const;
  // A random factor from 0.5 to 1 for a pause, so that the servers of a fleet do not all try again at the same moment.
  double jitter() { return random_.between(0.5, 1); }

  // Makes an `on_answer` of two functions. `parse` reads the text; `take` gets its result and the time. `take` returns
  // whether the result fits the request, or returns void where every result does.
  template <class Answer, class Take>
  auto reading(Result<Answer> (*parse)(std::string_view), Take take) {
    return [this, parse, take](std::string_view body, std::int64_t now_ns) {
      const Result<Answer> answer = parse(body);
      if (!answer) {
        warn_of(answer.error());
        return false;
      }
      failures_ = 0;
      if constexpr (std::is_void_v<decltype(take(*answer, now_ns))>) {
        take(*answer, now_ns);
        return true;
      } else {
        return take(*answer, now_ns);
      }
    };
  }

  // These take what the transport receives, as in EtcdSink.
  void on_answer(std::uint64_t id, int status, std::string_view body, std::int64_t now_ns);
  void on_line(std::uint64_t id, std::string_view line, std::int64_t now_ns);
  void on_error(std::uint64_t id, EtcdError error, std::int64_t now_ns);

 private:
  // Callers that have many requests, for rooms and their texts, send no more of them while is_full(): a server that
  // gets hundreds of rooms at once does not send hundreds of requests at once.
  static constexpr std::size_t kCallsMax = 32;
  struct Call {
    EtcdCallDef def;
    std::size_t endpoint = 0;
    // generation_ when the call was sent: only the first failure of a generation turns to the next endpoint.
    std::uint64_t generation = 0;
    std::int64_t deadline_ns = 0;
  };

  // Warns of an answer that cannot be read (event etcd_malformed).
  static void warn_of(const std::string& error);
  // Counts the failure, turns to the next endpoint and tells the sender. The call has left calls_ before.
  void fail(const Call& call, EtcdError error, std::int64_t now_ns);
  // The endpoint `failed` has failed: new calls ask the next one, and a watch there begins again.
  void turn_to_next_endpoint(std::size_t failed, EtcdError error, std::int64_t now_ns);

  const EtcdDirectoryDef* def_;
  EtcdTransport* transport_;
  FleetCounters* counters_;
  Random random_;
  // The usual time for an answer: a third of the lease over the number of endpoints, within bounds (etcd_calls.cpp).
  std::int64_t timeout_ns_;
  std::map<std::uint64_t, Call> calls_;
  std::uint64_t last_call_ = 0;
  // The index of the endpoint that new calls ask.
  std::size_t endpoint_ = 0;
  // The number of changes of endpoint_ so far.
  std::uint64_t generation_ = 0;
  // The number of failures in a row, since the last answer.
  std::size_t failures_ = 0;
  // may_start() is false before this time.
  std::int64_t retry_at_ns_ = 0;
};

}  // namespace hairnet::server
