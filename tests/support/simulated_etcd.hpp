#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/random.hpp"

namespace hairnet::support {

// As much of etcd 3.4 as a fleet needs, with the same JSON texts: one linearizable store with leases, transactions,
// watches and compaction. Time is an argument. The keys of a lease vanish up to a second after its end, as in etcd, and
// after an outage each lease has its full time again.
class SimulatedEtcd {
 public:
  struct Answer {
    int status = 200;
    std::string body;
  };
  // Gets one line of JSON, as etcd streams it to a watch.
  using OnLine = std::function<void(std::string)>;

  // The seed draws how late the keys of each lease vanish.
  explicit SimulatedEtcd(std::uint64_t seed = 1) : random_(seed) {}

  // Answers a request that is not a watch.
  Answer handle(const std::string& path, const std::string& body, std::int64_t now_ns);
  // Begins a watch and returns its number. Lines come at once, and whenever something changes.
  std::uint64_t watch(const std::string& body, OnLine on_line);
  void end_watch(std::uint64_t watch) { watches_.erase(watch); }
  // Ends leases whose time is over.
  void advance(std::int64_t now_ns);

  // Ends all watches. Nobody may send requests until come_up().
  void go_down();
  void come_up(std::int64_t now_ns);
  [[nodiscard]] bool is_down() const { return is_down_; }
  // Loses the disk: etcd begins again without keys and leases, at the first revision. Call it while etcd is down.
  void lose_data();
  // Makes etcd forget the history up to the newest revision: watches and lists that begin earlier fail.
  void compact() { compacted_ = revision_; }
  // These three act as another client of etcd would, without a request. remove() and end_lease_of() do nothing for a
  // key that does not exist.
  void remove(const std::string& key);
  void put(const std::string& key, const std::string& value);
  void end_lease_of(const std::string& key);

  // The keys of a lease vanish at most this long after the lease's end.
  double expiry_lag_s_max = 1;

  [[nodiscard]] std::vector<std::string> keys() const;
  [[nodiscard]] std::string value(const std::string& key) const;
  [[nodiscard]] std::size_t lease_count() const { return leases_.size(); }
  [[nodiscard]] std::size_t watch_count() const { return watches_.size(); }
  [[nodiscard]] std::int64_t revision() const { return revision_; }

 private:
  // The private functions follow etcd's API: range() reads keys, txn() runs a transaction, tell() sends a change to
  // all watches of its key, and revoke() ends a lease and erases its keys.
  using Json = nlohmann::json;
  // A key's value, and what etcd stores with it: the revisions of its creation and last change, the count of its
  // changes since its creation, and its lease, where 0 means none.
  struct Entry {
    std::string value;
    std::int64_t create_revision = 0, mod_revision = 0, version = 0, lease = 0;
  };
  // From `ends_ns` on the lease cannot be renewed; its keys vanish at `revoked_ns`, up to expiry_lag_s_max later.
  struct Lease {
    std::int64_t ttl_s = 0, ends_ns = 0, revoked_ns = 0;
  };
  struct Watch {
    // The keys in [begin, end) are watched.
    std::string begin, end;
    OnLine on_line;
  };
  // A change of a key. `event` is the JSON that watches get.
  struct Past {
    std::int64_t revision = 0;
    std::string key, event;
  };

  [[nodiscard]] std::string header() const;
  Answer refuse(int status, int code, const std::string& error) const;
  Answer range(const Json& request) const;
  Json found(const Json& range) const;
  Answer txn(const Json& request);
  void put(const std::string& key, const std::string& value, std::int64_t lease);
  void erase(const std::string& key);
  void tell(const std::string& key, const std::string& event);
  void revoke(std::int64_t lease);
  void renew(Lease& lease, std::int64_t now_ns);

  Random random_;
  std::map<std::string, Entry> entries_;
  std::map<std::int64_t, Lease> leases_;
  std::map<std::uint64_t, Watch> watches_;
  std::vector<Past> history_;
  // The newest revision, the revision up to which history is forgotten, and the id of the newest lease.
  std::int64_t revision_ = 1, compacted_ = 0, last_lease_ = 1000;
  std::uint64_t last_watch_ = 0;
  bool is_down_ = false;
};

}  // namespace hairnet::support
