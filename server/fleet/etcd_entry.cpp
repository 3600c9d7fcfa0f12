#include "server/fleet/etcd_entry.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/assert.hpp"
#include "server/fleet/fleet_values.hpp"
#include "server/fleet/fleet_view.hpp"

namespace hairnet::server {
namespace {

// At most one write in this time, because etcd sends each write to all servers of the fleet by their watches.
constexpr std::int64_t kTellInterval_ns = 1'000'000'000;
// The published free share is rounded to 1/32: a smaller change of the load is not worth a write to etcd.
constexpr double kAnnouncedShareSteps = 32;

}  // namespace

EtcdEntry::EtcdEntry(const EtcdDirectoryDef& def, EtcdCalls& calls, EtcdLease& lease)
    : calls_(&calls),
      lease_(&lease),
      key_(FleetKeys(def.fleet).of_server(def.server_id)),
      status_{.id = def.server_id, .address = def.address} {
  HAIRNET_ASSERT(def.server_id != 0);
}

void EtcdEntry::tell(const ServerLoad& load) {
  status_.load = load;
  const double share = std::clamp(load.free_share, 0.0, 1.0);
  status_.load.free_share = std::round(share * kAnnouncedShareSteps) / kAnnouncedShareSteps;
}

void EtcdEntry::drain() {
  status_.draining = true;
  // The next poll writes the entry at once: until other servers know that this one drains, they send clients here.
  tell_at_ns_ = 0;
}

void EtcdEntry::pass_on(std::vector<ContentHash> grooms) {
  if (grooms.size() > kPassedGroomsMax) grooms.resize(kPassedGroomsMax);
  status_.grooms = std::move(grooms);
}

void EtcdEntry::on_lease_granted() {
  written_.clear();
  tell_at_ns_ = 0;
}

void EtcdEntry::check(const etcd::KeyValue& entry) {
  // A deleted entry has no lease, so a deletion by another program is found, too.
  if (entry.key == key_ && entry.lease != lease_->id()) written_.clear();
}

void EtcdEntry::poll(std::int64_t now_ns) {
  const std::int64_t lease = lease_->id();
  if (lease == 0 || now_ns < tell_at_ns_ || calls_->is_under_way(call_)) return;
  const std::string value = to_value(status_);
  if (value == written_) return;
  const auto note_written = [this, value, lease](auto, auto) {
    // An entry of an earlier lease has vanished with it.
    if (lease == lease_->id()) written_ = value;
  };
  call_ = calls_->start({.request = etcd::put(key_, value, lease),
                         .on_answer = calls_->reading(etcd::parse_put, note_written),
                         .on_lease_gone = [this, lease](auto at_ns) { lease_->lose(lease, at_ns); }},
                        now_ns);
  tell_at_ns_ = now_ns + kTellInterval_ns;
}

}  // namespace hairnet::server
