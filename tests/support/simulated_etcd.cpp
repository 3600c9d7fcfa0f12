#include "tests/support/simulated_etcd.hpp"

#include <sodium.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/assert.hpp"

namespace hairnet::support {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

// Returns the text of a field, which etcd writes as base64; empty when the field is missing.
std::string plain(const nlohmann::json& object, const char* name) {
  if (!object.contains(name)) return {};
  const auto coded = object.at(name).get<std::string>();
  std::string text(coded.size(), '\0');
  std::size_t length = 0;
  const int error = sodium_base642bin(reinterpret_cast<unsigned char*>(text.data()), text.size(), coded.data(),
                                      coded.size(), nullptr, &length, nullptr, sodium_base64_VARIANT_ORIGINAL);
  HAIRNET_ASSERT(error == 0);
  text.resize(length);
  return text;
}

std::string coded(const std::string& text) {
  std::string base64(sodium_base64_encoded_len(text.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(base64.data(), base64.size(), reinterpret_cast<const unsigned char*>(text.data()), text.size(),
                    sodium_base64_VARIANT_ORIGINAL);
  // The encoder counts and writes a final zero byte.
  base64.pop_back();
  return base64;
}

// Returns the number of a field, which etcd writes as text; 0 when the field is missing.
std::int64_t whole(const nlohmann::json& object, const char* name) {
  if (!object.contains(name)) return 0;
  return std::stoll(object.at(name).get<std::string>());
}

// Sets a number as etcd writes it: as text, and left out when it is zero.
void set(nlohmann::json& object, const char* name, std::int64_t number) {
  if (number != 0) object[name] = std::to_string(number);
}

}  // namespace

std::string SimulatedEtcd::header() const {
  return R"({"cluster_id":"14841639068965178418","member_id":"10276657743932975437","revision":")" +
         std::to_string(revision_) + R"(","raft_term":"2"})";
}

// The code of an error is that of gRPC: 5 is "not found", 11 is "out of range".
SimulatedEtcd::Answer SimulatedEtcd::refuse(int status, int code, const std::string& error) const {
  return {status, Json{{"error", error}, {"message", error}, {"code", code}}.dump()};
}

// The paths are those of etcd's JSON gateway, and a body is one JSON object.
SimulatedEtcd::Answer SimulatedEtcd::handle(const std::string& path, const std::string& body, std::int64_t now_ns) {
  HAIRNET_ASSERT(!is_down_);
  advance(now_ns);
  const Json request = Json::parse(body);
  const auto lease_gone = [this] { return refuse(404, 5, "etcdserver: requested lease not found"); };
  if (path == "/v3/lease/grant") {
    const std::int64_t id = ++last_lease_;
    Lease& lease = leases_[id];
    lease.ttl_s = whole(request, "TTL");
    renew(lease, now_ns);
    return {200, R"({"header":)" + header() + R"(,"ID":")" + std::to_string(id) + R"(","TTL":")" +
                     std::to_string(lease.ttl_s) + "\"}"};
  }
  if (path == "/v3/lease/keepalive") {
    const std::int64_t id = whole(request, "ID");
    const auto lease = leases_.find(id);
    std::string ttl;
    if (lease != leases_.end() && now_ns >= lease->second.ends_ns) {
      // The lease's time is over: etcd answers only once the lease has gone.
      revoke(id);
    } else if (lease != leases_.end()) {
      renew(lease->second, now_ns);
      ttl = R"(,"TTL":")" + std::to_string(lease->second.ttl_s) + "\"";
    }
    // An answer without a TTL tells the client that the lease has gone.
    return {200, R"({"result":{"header":)" + header() + R"(,"ID":")" + std::to_string(id) + "\"" + ttl + "}}\n"};
  }
  if (path == "/v3/lease/timetolive") {
    const std::int64_t id = whole(request, "ID");
    const auto lease = leases_.find(id);
    const bool is_gone = lease == leases_.end();
    Json answer{{"header", Json::parse(header())}, {"ID", std::to_string(id)}};
    // The TTL is the remaining time in whole seconds, and -1 for a lease that has gone.
    set(answer, "TTL", is_gone ? -1 : std::max<std::int64_t>((lease->second.ends_ns - now_ns) / kSecond_ns, 0));
    return {200, answer.dump()};
  }
  if (path == "/v3/lease/revoke") {
    if (!leases_.contains(whole(request, "ID"))) return lease_gone();
    revoke(whole(request, "ID"));
    return {200, R"({"header":)" + header() + "}"};
  }
  if (path == "/v3/kv/range") return range(request);
  if (path == "/v3/kv/put") {
    const std::int64_t lease = whole(request, "lease");
    if (lease != 0 && !leases_.contains(lease)) return lease_gone();
    put(plain(request, "key"), plain(request, "value"), lease);
    return {200, R"({"header":)" + header() + "}"};
  }
  if (path == "/v3/kv/txn") return txn(request);
  return {404, "Not Found"};
}

SimulatedEtcd::Answer SimulatedEtcd::range(const Json& request) const {
  const std::int64_t at = whole(request, "revision");
  if (at != 0 && at < compacted_) return refuse(400, 11, "etcdserver: mvcc: required revision has been compacted");
  if (at > revision_) return refuse(400, 11, "etcdserver: mvcc: required revision is a future revision");
  Json answer = found(request);
  answer["header"] = Json::parse(header());
  return {200, answer.dump()};
}

SimulatedEtcd::Json SimulatedEtcd::found(const Json& range) const {
  const std::string begin = plain(range, "key"), end = plain(range, "range_end");
  const std::int64_t limit = whole(range, "limit"), at = whole(range, "revision");
  Json answer = Json::object();
  std::int64_t count = 0;
  // Only the newest state is stored: a page of an older revision shows it without what came later.
  for (const auto& [key, entry] : entries_) {
    if (end.empty() ? key != begin : key < begin || key >= end) continue;
    if (at != 0 && entry.mod_revision > at) continue;
    if (limit != 0 && count == limit) {
      answer["more"] = true;
      break;
    }
    ++count;
    Json kv{{"key", coded(key)}};
    if (!range.value("keys_only", false)) kv["value"] = coded(entry.value);
    set(kv, "create_revision", entry.create_revision);
    set(kv, "mod_revision", entry.mod_revision);
    set(kv, "version", entry.version);
    set(kv, "lease", entry.lease);
    answer["kvs"].push_back(kv);
  }
  set(answer, "count", count);
  return answer;
}

// Runs the operations of `success` when all comparisons hold, and those of `failure` otherwise. Only comparisons of
// a key's create_revision are simulated, where 0 means that the key does not exist.
SimulatedEtcd::Answer SimulatedEtcd::txn(const Json& request) {
  bool holds = true;
  for (const Json& compare : request.at("compare")) {
    HAIRNET_ASSERT(compare.at("target") == "CREATE" && compare.at("result") == "EQUAL");
    const auto found = entries_.find(plain(compare, "key"));
    holds &= (found == entries_.end() ? 0 : found->second.create_revision) == whole(compare, "create_revision");
  }
  Json answer{{"header", Json::object()}};
  if (holds) answer["succeeded"] = true;
  const char* branch = holds ? "success" : "failure";
  if (request.contains(branch)) {
    for (const Json& operation : request.at(branch)) {
      if (operation.contains("request_put")) {
        const Json& of = operation.at("request_put");
        const std::int64_t lease = whole(of, "lease");
        if (lease != 0 && !leases_.contains(lease)) return refuse(404, 5, "etcdserver: requested lease not found");
        put(plain(of, "key"), plain(of, "value"), lease);
        answer["responses"].push_back({{"response_put", {{"header", {{"revision", std::to_string(revision_)}}}}}});
      } else if (operation.contains("request_delete_range")) {
        erase(plain(operation.at("request_delete_range"), "key"));
        answer["responses"].push_back({{"response_delete_range", {{"deleted", "1"}}}});
      } else {
        answer["responses"].push_back({{"response_range", found(operation.at("request_range"))}});
      }
    }
  }
  answer["header"] = Json::parse(header());
  return {200, answer.dump()};
}

void SimulatedEtcd::put(const std::string& key, const std::string& value) {
  put(key, value, 0);
}

void SimulatedEtcd::put(const std::string& key, const std::string& value, std::int64_t lease) {
  Entry& entry = entries_[key];
  entry.value = value;
  entry.mod_revision = ++revision_;
  if (entry.create_revision == 0) entry.create_revision = revision_;
  ++entry.version;
  entry.lease = lease;
  Json kv{{"key", coded(key)}, {"value", coded(value)}};
  set(kv, "create_revision", entry.create_revision);
  set(kv, "mod_revision", entry.mod_revision);
  set(kv, "version", entry.version);
  set(kv, "lease", entry.lease);
  tell(key, Json{{"kv", kv}}.dump());
}

void SimulatedEtcd::erase(const std::string& key) {
  if (entries_.erase(key) == 0) return;
  ++revision_;
  Json kv{{"key", coded(key)}};
  set(kv, "mod_revision", revision_);
  tell(key, Json{{"type", "DELETE"}, {"kv", kv}}.dump());
}

void SimulatedEtcd::tell(const std::string& key, const std::string& event) {
  history_.push_back({revision_, key, event});
  const std::string line = R"({"result":{"header":)" + header() + R"(,"events":[)" + event + "]}}";
  for (const auto& [id, watch] : watches_)
    if (key >= watch.begin && key < watch.end) watch.on_line(line);
}

// Sends the changes since `start_revision` at once. If some of them are forgotten, the watch is cancelled and gets
// the number 0.
std::uint64_t SimulatedEtcd::watch(const std::string& body, OnLine on_line) {
  const Json request = Json::parse(body).at("create_request");
  const Watch watch{plain(request, "key"), plain(request, "range_end"), std::move(on_line)};
  const std::int64_t from = whole(request, "start_revision");
  watch.on_line(R"({"result":{"header":)" + header() + R"(,"created":true}})");
  if (from != 0 && from <= compacted_) {
    watch.on_line(R"({"result":{"header":{"raft_term":"2"},"canceled":true,"compact_revision":")" +
                  std::to_string(compacted_) + "\"}}");
    return 0;
  }
  std::string events;
  for (const Past& past : history_)
    if (from != 0 && past.revision >= from && past.key >= watch.begin && past.key < watch.end)
      events += (events.empty() ? "" : ",") + past.event;
  if (!events.empty()) watch.on_line(R"({"result":{"header":)" + header() + R"(,"events":[)" + events + "]}}");
  watches_.emplace(++last_watch_, watch);
  return last_watch_;
}

void SimulatedEtcd::advance(std::int64_t now_ns) {
  std::vector<std::int64_t> over;
  for (const auto& [id, lease] : leases_)
    if (now_ns >= lease.revoked_ns) over.push_back(id);
  for (const std::int64_t id : over) revoke(id);
}

void SimulatedEtcd::renew(Lease& lease, std::int64_t now_ns) {
  lease.ends_ns = now_ns + lease.ttl_s * kSecond_ns;
  lease.revoked_ns =
      lease.ends_ns + static_cast<std::int64_t>(random_.unit() * expiry_lag_s_max * static_cast<double>(kSecond_ns));
}

void SimulatedEtcd::revoke(std::int64_t lease) {
  std::vector<std::string> gone;
  for (const auto& [key, entry] : entries_)
    if (entry.lease == lease) gone.push_back(key);
  for (const std::string& key : gone) erase(key);
  leases_.erase(lease);
}

void SimulatedEtcd::go_down() {
  is_down_ = true;
  watches_.clear();
}

void SimulatedEtcd::lose_data() {
  entries_.clear();
  leases_.clear();
  history_.clear();
  revision_ = 1;
  compacted_ = 0;
}

void SimulatedEtcd::come_up(std::int64_t now_ns) {
  is_down_ = false;
  for (auto& [id, lease] : leases_) renew(lease, now_ns);
}

void SimulatedEtcd::remove(const std::string& key) {
  erase(key);
}

void SimulatedEtcd::end_lease_of(const std::string& key) {
  const auto found = entries_.find(key);
  if (found != entries_.end()) revoke(found->second.lease);
}

std::vector<std::string> SimulatedEtcd::keys() const {
  std::vector<std::string> keys;
  for (const auto& [key, entry] : entries_) keys.push_back(key);
  return keys;
}

std::string SimulatedEtcd::value(const std::string& key) const {
  const auto found = entries_.find(key);
  return found == entries_.end() ? "" : found->second.value;
}

}  // namespace hairnet::support
