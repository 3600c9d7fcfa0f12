#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/random.hpp"
#include "server/fleet/etcd_api.hpp"
#include "server/fleet/etcd_transport.hpp"
#include "tests/support/simulated_etcd.hpp"
#include "tests/whole/timeline.hpp"

namespace hairnet::whole {

// The messages that get lost without an error.
enum class LineCut : std::uint8_t {
  none,
  // Both directions are cut, and etcd's machine may refuse connections.
  both,
  // etcd does not hear the server.
  requests,
  // The server does not hear etcd.
  answers,
};

// etcd and the line between it and the servers.
struct EtcdLine {
  EtcdLine(Timeline& timeline_of_all, std::uint64_t seed) : timeline(&timeline_of_all), etcd(seed) {}
  // Call it once. From then on etcd's leases end at their time.
  void keep_time();
  void come_up() { etcd.come_up(now_ns()); }
  // Writes a value that no server can use, as a faulty program might. It stays until `end_ns`, unless a server
  // overwrites it.
  void put_bad_value(const std::string& key, std::int64_t end_ns, Random& random);
  // Reads etcd's own clock.
  [[nodiscard]] std::int64_t now_ns() const {
    return static_cast<std::int64_t>(static_cast<double>(timeline->now_ns()) * clock_rate);
  }

  Timeline* timeline;
  support::SimulatedEtcd etcd;
  // Each request and each answer gets lost with this probability.
  double loss = 0;
  // This share of the messages is late, by up to `slow_ns`.
  double slow = 0.02;
  std::int64_t slow_ns = 500 * kMs;
  // The indices of the endpoints that answer nobody.
  std::set<std::size_t> dead_members;
  // An endpoint that does not answer refuses no connection either, so calls get no error.
  bool is_silent = false;
  // This share of the answers, and of the lines of watches, is damaged; another share comes twice.
  double damaged = 0;
  double repeated = 0;
  // The rate of etcd's own clock, where 1 is that of the timeline.
  double clock_rate = 1;
  // A longer answer is refused. Real servers take more, but long values take time here. Two values of the largest size
  // do not fit into an answer.
  static constexpr std::size_t kAnswerBytesMax = 2 * server::etcd::kValueBytesMax;
};

// A server's end of that line.
class EtcdLineEnd final : public server::EtcdTransport {
 public:
  // `line` must outlive this end. `own_ns` returns the time of the server's clock.
  EtcdLineEnd(EtcdLine& line, std::function<std::int64_t()> own_ns, std::uint64_t seed);
  ~EtcdLineEnd() override;

  // Call it once, before the first call of send(). The sink must outlive this end.
  void set_sink(server::EtcdSink* sink) { sink_ = sink; }
  void send(server::EtcdCall call) override;
  void cancel(std::uint64_t call) override;

  // The process of the server stands still: messages that arrive wait until resume().
  void pause() { is_paused_ = true; }
  void resume();
  void cut(LineCut cut);
  // Delays the answers of etcd; 0 ends the delay.
  void make_late(std::int64_t late_ns) { late_ns_ = late_ns; }
  void break_streams();
  [[nodiscard]] bool is_good() const { return cut_ == LineCut::none && late_ns_ == 0; }

  // This is called after each message to the sink; may be empty.
  std::function<void()> on_delivered;

 private:
  struct Stream {
    std::uint64_t watch = 0;
    // The arrival of the stream's newest line, before which no later line may arrive.
    std::int64_t last_ns = 0;
    // The lines of a dead stream get lost, and neither end notices it.
    bool is_dead = false;
  };
  [[nodiscard]] std::int64_t delay();
  [[nodiscard]] std::string corrupt(std::string text);
  [[nodiscard]] bool loses_answers() const { return cut_ == LineCut::both || cut_ == LineCut::answers; }
  [[nodiscard]] bool is_reached(std::size_t endpoint) const;
  void arrive(server::EtcdCall call);
  void deliver(std::uint64_t call, std::int64_t at_ns, std::function<void()> action);
  void refuse(std::uint64_t call);
  void open_stream(const server::EtcdCall& call);

  EtcdLine* line_;
  std::function<std::int64_t()> own_ns_;
  Random random_;
  server::EtcdSink* sink_ = nullptr;
  // Actions on the timeline hold a weak pointer to it, so that they do nothing once this end is destroyed.
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  // The calls that the directory waits for.
  std::set<std::uint64_t> open_;
  std::map<std::uint64_t, Stream> streams_;
  // The messages that arrived during a pause.
  std::vector<std::function<void()>> waiting_;
  LineCut cut_ = LineCut::none;
  std::int64_t late_ns_ = 0;
  bool is_paused_ = false;
};

}  // namespace hairnet::whole
