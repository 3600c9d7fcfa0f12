#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "core/random.hpp"
#include "server/fleet/etcd_transport.hpp"
#include "tests/support/simulated_etcd.hpp"
#include "tests/whole/timeline.hpp"

namespace hairnet::whole {

// etcd and the line between it and the servers.
struct EtcdLine {
  EtcdLine(Timeline& timeline_of_all, std::uint64_t seed) : timeline(&timeline_of_all), etcd(seed) {}
  void keep_time();  // from now on leases end by themselves
  void come_up() { etcd.come_up(now_ns()); }
  [[nodiscard]] std::int64_t now_ns() const {  // by etcd's own clock
    return static_cast<std::int64_t>(static_cast<double>(timeline->now_ns()) * clock_rate);
  }

  Timeline* timeline;
  support::SimulatedEtcd etcd;
  double loss = 0;                     // of a request, and of an answer
  double slow = 0.02;                  // share of messages that are late
  std::int64_t slow_ns = 500 * kMs;    // at most so late
  std::set<std::size_t> dead_members;  // endpoints that answer nobody
  bool is_silent = false;              // what does not answer refuses no connection either
  double clock_rate = 1;               // of etcd's own clock
};

// A server's end of that line.
class EtcdLineEnd final : public server::EtcdTransport {
 public:
  // `own_ns`: the server's clock.
  EtcdLineEnd(EtcdLine& line, std::function<std::int64_t()> own_ns, std::uint64_t seed);
  ~EtcdLineEnd() override;

  void set_sink(server::EtcdSink* sink) { sink_ = sink; }  // once, before the first call
  void send(server::EtcdCall call) override;
  void cancel(std::uint64_t call) override;

  void pause() { is_paused_ = true; }  // the server's process stands still: what arrives waits
  void resume();
  void cut(bool is_cut);  // off from etcd
  void break_streams();
  [[nodiscard]] bool is_cut() const { return is_cut_; }

  std::function<void()> on_delivered;  // something to the sink; may be empty

 private:
  struct Stream {
    std::uint64_t watch = 0;
    std::int64_t last_ns = 0;  // lines arrive in order
    bool is_dead = false;      // silently
  };
  [[nodiscard]] std::int64_t delay();
  [[nodiscard]] bool is_reached(std::size_t endpoint) const;
  void arrive(server::EtcdCall call);
  void deliver(std::uint64_t call, std::int64_t at_ns, std::function<void()> action);
  void refuse(std::uint64_t call);
  void open_stream(const server::EtcdCall& call);

  EtcdLine* line_;
  std::function<std::int64_t()> own_ns_;
  Random random_;
  server::EtcdSink* sink_ = nullptr;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  std::set<std::uint64_t> open_;  // calls that the directory waits for
  std::map<std::uint64_t, Stream> streams_;
  std::vector<std::function<void()>> waiting_;  // arrived while paused
  bool is_cut_ = false, is_paused_ = false;
};

}  // namespace hairnet::whole
