#pragma once

#include <cstdint>
#include <memory>
#include <queue>
#include <unordered_map>
#include <vector>

#include "tests/load/schedule.hpp"
#include "tests/load/virtual_client.hpp"

namespace hairnet::load {

// All virtual clients of a run. The fleet has no I/O and no clock: the caller passes the time, at next_ns() or earlier.
// Use it on one thread.
class Fleet {
 public:
  // Sets `wake`, `hand_clocks` and `sent_props` of the context itself. `plan` must outlive the fleet.
  Fleet(const Plan& plan, ClientContext context, std::int64_t begin_ns);
  Fleet(const Fleet&) = delete;
  Fleet& operator=(const Fleet&) = delete;

  // Does all that is due by `now_ns`.
  void advance(std::int64_t now_ns);
  // Returns the time at which something is due next; kNever_ns when nothing is.
  [[nodiscard]] std::int64_t next_ns() const;
  // The plan is over: counts unanswered poses, and sends goodbyes. Then call advance() until empty(), or until the
  // caller's time limit.
  void finish(std::int64_t now_ns);
  [[nodiscard]] bool empty() const { return virtual_clients_.empty(); }

  // Count well-behaved clients that have not left, and their characters.
  [[nodiscard]] std::size_t client_count() const { return counted_clients_; }
  [[nodiscard]] std::size_t character_count() const { return characters_; }
  // The number of misbehaving clients, and of well-behaved ones that have left but still wait for the end of their
  // connection.
  [[nodiscard]] std::size_t bad_client_count() const { return virtual_clients_.size() - counted_clients_; }

 private:
  // An entry of the queue: act() of this client is due.
  struct Due {
    std::int64_t at_ns;
    std::uint32_t client;
    bool operator>(const Due& other) const { return at_ns > other.at_ns; }
  };
  struct Member {
    std::unique_ptr<VirtualClient> virtual_client;
    // Only the entry of the queue with this time counts. Other entries of the client are outdated, and are skipped.
    std::int64_t due_ns = kNever_ns;
  };
  void perform(const Action& action, std::int64_t now_ns);
  void join(const Action& action, std::int64_t now_ns);
  void act(const Due& due, std::int64_t now_ns);
  void wake(std::uint32_t client, std::int64_t at_ns);
  void remove_gone();

  const Plan* plan_;
  ClientContext context_;
  // The capture times of the clients' hands, by session. The clients that see the hands compute latencies with them.
  std::unordered_map<std::uint64_t, PoseClock> hand_clocks_;
  // The changes of props that clients have sent. The clients that see the props compute latencies with them.
  SentProps sent_props_;
  std::int64_t begin_ns_;
  std::vector<Action> schedule_;
  std::size_t next_action_ = 0;
  std::unordered_map<std::uint32_t, Member> virtual_clients_;
  std::priority_queue<Due, std::vector<Due>, std::greater<>> queue_;
  // The clients that may have left since the last remove_gone(). They are destroyed there, outside their own calls.
  std::vector<std::uint32_t> maybe_gone_;
  std::size_t counted_clients_ = 0, characters_ = 0;
};

}  // namespace hairnet::load
