#include "server/app/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <sstream>
#include <utility>

#include "core/assert.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/recording.hpp"

namespace hairnet::server {
namespace {

// kWholeMax is for integers that need no upper bound, kGiB for bounds in bytes.
constexpr std::int64_t kWholeMax = std::numeric_limits<std::int64_t>::max();
constexpr std::int64_t kGiB = std::int64_t{1} << 30;

// Lists are one text in file and flag, with commas or spaces between their words.
std::vector<std::string> words_of(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

// Builds the list. Each call adds a setting to the current section: the member of Config that it sets, its key, for
// numbers the smallest and the largest valid value, and the text of --help. A reference that a call returns is valid
// until the next call, since the vector may move its settings.
class List {
 public:
  void section(std::string name) { section_ = std::move(name); }

  // A whole number. An empty flag means the key's own name with dashes.
  template <class Integer>
  Setting& integer(Integer& to, const char* key, std::int64_t least, std::int64_t most, const char* about,
                   const char* flag = "") {
    HAIRNET_ASSERT(least <= most);
    Setting& s = add(key, flag, about);
    s.integer_min = least;
    s.integer_max = most;
    s.get = [&to] { return Setting::Value(static_cast<std::int64_t>(to)); };
    s.set = [&to](const Setting::Value& v) { to = static_cast<Integer>(std::get<std::int64_t>(v)); };
    return s;
  }
  // A number that may have a fraction.
  template <class Real>
  Setting& number(Real& to, const char* key, double least, double most, const char* about, const char* flag = "") {
    Setting& s = ranged(key, flag, about, least, most);
    s.get = [&to] { return Setting::Value(static_cast<double>(to)); };
    s.set = [&to](const Setting::Value& v) { to = static_cast<Real>(std::get<double>(v)); };
    return s;
  }
  // A duration that the file and the flag have in seconds; the member has it in nanoseconds, or in milliseconds.
  Setting& seconds(std::int64_t& to_ns, const char* key, double least, double most, const char* about) {
    Setting& s = ranged(key, "", about, least, most);
    s.get = [&to_ns] { return Setting::Value(static_cast<double>(to_ns) / 1e9); };
    s.set = [&to_ns](const Setting::Value& v) { to_ns = std::llround(std::get<double>(v) * 1e9); };
    return s;
  }
  Setting& seconds(std::chrono::milliseconds& to, const char* key, double least, double most, const char* about) {
    Setting& s = ranged(key, "", about, least, most);
    s.get = [&to] { return Setting::Value(static_cast<double>(to.count()) / 1e3); };
    s.set = [&to](const Setting::Value& v) { to = std::chrono::milliseconds(std::llround(std::get<double>(v) * 1e3)); };
    return s;
  }
  // A list of words, which the text separates by spaces or commas.
  Setting& words(std::vector<std::string>& to, const char* key, const char* about) {
    Setting& s = add(key, "", about);
    s.get = [&to] { return Setting::Value(fmt::format("{}", fmt::join(to, " "))); };
    s.set = [&to](const Setting::Value& v) { to = words_of(std::get<std::string>(v)); };
    return s;
  }
  // A text; with `choices`, only one of these.
  Setting& text(std::string& to, const char* key, const char* about, std::vector<std::string> choices = {}) {
    Setting& s = add(key, "", about);
    s.choices = std::move(choices);
    s.get = [&to] { return Setting::Value(to); };
    s.set = [&to](const Setting::Value& v) { to = std::get<std::string>(v); };
    return s;
  }
  // One of the words, which are in the order of the enum's values.
  template <class Enum>
  Setting& choice(Enum& to, const char* key, const char* about, std::vector<std::string> words, const char* flag = "") {
    Setting& s = add(key, flag, about);
    s.choices = words;
    s.get = [&to, words] { return Setting::Value(words.at(static_cast<std::size_t>(to))); };
    // check() has let through only these words.
    s.set = [&to, words](const Setting::Value& v) {
      to = static_cast<Enum>(std::ranges::find(words, std::get<std::string>(v)) - words.begin());
    };
    return s;
  }
  // True or false.
  Setting& boolean(bool& to, const char* key, const char* about, const char* flag = "") {
    Setting& s = add(key, flag, about);
    s.get = [&to] { return Setting::Value(to); };
    s.set = [&to](const Setting::Value& v) { to = std::get<bool>(v); };
    return s;
  }
  // Three numbers, such as the coordinates of a vector.
  Setting& triple(Vec3& to, const char* key, double least, double most, const char* about, const char* flag) {
    Setting& s = ranged(key, flag, about, least, most);
    s.get = [&to] { return Setting::Value(Setting::Triple{to[0], to[1], to[2]}); };
    s.set = [&to](const Setting::Value& v) { to = Vec3(std::get<Setting::Triple>(v).data()); };
    return s;
  }

  std::vector<Setting> take() { return std::move(settings_); }

 private:
  // Appends a setting that has only its names and its text.
  Setting& add(const char* key, std::string flag, const char* about) {
    if (flag.empty()) {
      flag = std::string("--") + key;
      // Flags have dashes and keys underscores, as people know both; one name serves for the two.
      std::replace(flag.begin(), flag.end(), '_', '-');
    }
    Setting& s = settings_.emplace_back();
    s.section = section_;
    s.key = key;
    s.flag = std::move(flag);
    s.about = about;
    return s;
  }
  // Appends a setting with the bounds of its number.
  Setting& ranged(const char* key, const char* flag, const char* about, double least, double most) {
    HAIRNET_ASSERT(least <= most);
    Setting& s = add(key, flag, about);
    s.number_min = least;
    s.number_max = most;
    return s;
  }

  std::string section_;
  std::vector<Setting> settings_;
};

// There is one function for each section of the file.
void add_server(List& list, Config& c) {
  list.section("server");
  list.text(c.bind, "bind", "numeric address to listen on, or localhost").may_be_empty = false;
  list.integer(c.port, "port", 0, 65535, "TCP port; 0 picks a free one");
  list.integer(c.service_port, "service_port", 0, 65535,
               "TCP port of /healthz, /readyz and /metrics alone, without TLS; 0: they are on the other port");
  list.text(c.service_bind, "service_bind", "numeric address to listen on for service_port, or localhost")
      .may_be_empty = false;
  list.text(c.port_file, "port_file", "write the port in use to this file; empty: nowhere");
  list.integer(c.tick_rate_hz, "tick_rate_hz", 10, 120, "steps and frames a second", "--tick-rate");
  list.number(c.pose_delay_ms, "pose_delay_ms", 0, 200, "poses are sampled this far back");
  list.number(c.tick_budget, "tick_budget", 0.05, 0.95,
              "share of a tick that its work may take; detail is lowered to stay within it");
  list.integer(
      c.workers, "workers", 0, 256,
      "threads of a tick; 0: one for each hardware thread, minus one for the network if there are more than two");
  list.integer(
      c.memory_max_mib, "memory_max_mib", 0, std::int64_t{1} << 30,
      "MiB of memory; the server then refuses what needs more; 0: half of what the machine or the control group has",
      "--memory-max");
  list.text(c.token_key_file, "token_key_file",
            "clients need tokens signed by the key in this file (hairnet-token key); empty: they need none");
  list.text(c.token_revoked_file, "token_revoked_file",
            "refuse the tokens whose id (jti) or subject is a line of this file, which is read again when it changes; "
            "empty: none");
  list.number(c.drain_s, "drain_s", 0, 600, "seconds at shutdown for clients to read their waiting packets");
  list.text(c.record, "record", "write a recording to this file; empty: none");
}

void add_solver(List& list, Config& c) {
  list.section("solver");
  list.integer(c.substeps, "substeps", 0, 16, "solver steps a tick; 0: enough that no step exceeds 1/50 s");
  list.integer(c.iterations, "iterations", 0, 256, "iterations of conjugate gradient a step; 0: each level's own");
}

// The words of AllowedClients, in the order of its values.
std::vector<std::string> allowed_clients() {
  return {"off", "moderators", "participants", "everyone"};
}

void add_wind(List& list, Config& c) {
  Wind& w = c.wind;
  list.section("wind");
  list.triple(w.mean_m_per_s, "mean_m_per_s", -60, 60, "mean wind, m/s, world: X Y Z", "--wind");
  list.number(w.gust_ratio, "gust_ratio", 0, 1, "gusts change the mean by this share", "--gust");
  list.number(w.gust_period_s, "gust_period_s", 0.2, 120, "seconds of the slowest gust", "--gust-period");
  list.number(w.turbulence_rms_m_per_s, "turbulence_rms_m_per_s", 0, 20, "m/s of each component, root mean square",
              "--turbulence");
  list.number(w.turbulence_scale_m, "turbulence_scale_m", kTurbulenceScaleMin_m, 100,
              "metres over which turbulence changes", "--turbulence-scale");
  list.integer(w.seed, "seed", 0, kWholeMax, "another seed, another turbulence", "--wind-seed");
  list.boolean(w.carried, "carried", "the air goes along with each head, as in a vehicle", "--wind-carried");
  list.choice(c.sessions.wind_from_clients, "from_clients", "which clients may set their room's wind",
              allowed_clients(), "--wind-from-clients");
}

void add_props(List& list, Config& c) {
  list.section("props");
  list.choice(c.sessions.props_from_clients, "from_clients", "which clients may set their room's props",
              allowed_clients(), "--props-from-clients");
}

void add_limits(List& list, Config& c) {
  SessionLimits& s = c.sessions;
  list.section("limits");
  list.integer(s.session_count_max, "clients_max", 1, 10'000, "clients at once");
  list.integer(s.character_count_max, "characters_max", 1, 65'536, "characters of all clients");
  list.integer(s.characters_per_session_max, "characters_per_client_max", 1, 65'536,
               "characters of one client; characters_max applies too");
  list.integer(s.room_count_max, "rooms_max", 1, wire::kRecordedRoomCountMax, "rooms at once");
  list.integer(s.sessions_per_room_max, "clients_per_room_max", 1, 10'000, "clients of one room");
  list.integer(s.characters_per_room_max, "characters_per_room_max", 1, 65'536, "characters of one room");
  list.integer(s.sessions_per_subject_max, "clients_per_subject_max", 1, 10'000,
               "clients of one subject, which their tokens name");
  list.integer(s.sessions_per_address_max, "clients_per_address_max", 1, 10'000,
               "clients of one IPv4 address or IPv6 /64 whose tokens name no subject");
  list.integer(s.characters_per_subject_max, "characters_per_subject_max", 1, 65'536,
               "characters of one subject, or of one address without one");
  list.integer(s.bans_max, "bans_max", 0, 1 << 20, "bans, mutes and locks by moderators, of all rooms");
  list.number(s.messages_per_s, "messages_per_s", 1, 1e6, "messages of a client, mean; costly ones count more");
  list.number(s.messages_burst, "messages_burst", 1, 1e7, "messages of a client, at once");
  list.number(s.poses_per_s, "poses_per_s", 1, 1e8, "poses of a client, and samples of its hands, mean");
  list.number(s.poses_burst, "poses_burst", 1, 1e8, "poses of a client, and samples of its hands, at once");
  list.seconds(s.idle_timeout_ns, "idle_timeout_s", 1, 86'400,
               "seconds without a message, then a session ends whose client promises no signs of life (others: 10 s)");
  list.seconds(s.resume_grace_ns, "resume_grace_s", 0, 3600,
               "seconds in which a client may resume after its connection broke");
  list.seconds(c.room_grace_ns, "room_grace_s", 0, 86'400,
               "seconds that an empty room exists, with its mutes, lock and props");
}

void add_transport(List& list, Config& c) {
  TransportOptions& t = c.transport;
  AdmissionLimits& a = t.admission;
  list.section("transport");
  list.text(t.web_root, "web_root", "folder of pages to serve; empty: none");
  list.words(t.origins, "origins",
             "pages that may open a WebSocket, as https://host[:port], * for all; empty: the server's own, and on the "
             "loopback those of localhost with any port");
  list.words(t.hosts, "hosts",
             "names that the Host of requests may have, * for all; empty: all, but on the loopback a page opens a "
             "WebSocket as localhost only. Numeric addresses always pass");
  list.text(t.tls.certificate, "tls_certificate", "PEM file, the certificate's chain; empty: no TLS");
  list.text(t.tls.key, "tls_key", "PEM file, the certificate's key, without a passphrase");
  list.boolean(t.tls_required, "tls_required", "refuse plain connections");
  list.boolean(t.webtransport, "webtransport",
               "WebTransport for browsers, on a UDP port; without a certificate the server makes its own");
  list.integer(t.udp_port, "udp_port", 0, 65535, "UDP port of WebTransport; 0: the number of the TCP port");
  list.integer(a.connections_max, "connections_max", 0, 1 << 20,
               "connections of all kinds; 0: enough for clients_max and pages");
  list.integer(a.connections_per_address_max, "connections_per_address_max", 0, 1 << 20,
               "connections of one IPv4 address or IPv6 /64; 0: no bound");
  list.number(a.connections_per_s, "connections_per_s", 1, 1e6,
              "new connections of all addresses, mean; more wait in the system's queue");
  list.number(a.connections_per_address_per_s, "connections_per_address_per_s", 0.01, 1e6,
              "new connections of one address, mean");
  list.words(t.exempt_addresses, "exempt_addresses",
             "numeric addresses that the limits of one address do not apply to");
  list.words(t.proxy_protocol, "proxy_protocol",
             "numeric addresses of proxies: their connections must begin with a header of the PROXY protocol");
  list.seconds(
      t.ping_after, "ping_after_s", 0.1, 600,
      "seconds after which a silent WebSocket is pinged; after twice this it is closed (WebTransport: 5 at most)");
}

void add_grooms(List& list, Config& c) {
  GroomStoreLimits& g = c.grooms;
  // No setting may exceed the built-in limits of grooms.
  const GroomLimits most;
  const auto of = [](std::size_t n) { return static_cast<std::int64_t>(n); };
  list.section("grooms");
  list.integer(g.groom_bytes_max, "groom_bytes_max", 1024, of(wire::kGroomBytesMax), "bytes of one groom");
  list.integer(g.upload_bytes_max, "upload_bytes_max", 1024, 64 * kGiB,
               "bytes received for grooms that are not built yet; by default room for four grooms at least");
  list.integer(g.level_bytes_max, "level_bytes_max", 1 << 20, 1024 * kGiB, "bytes of all levels in memory");
  list.integer(g.groom_count_max, "grooms_max", 1, 1 << 20, "grooms of all clients");
  list.integer(g.grooms_per_session_max, "grooms_per_client_max", 1, 1 << 20, "grooms of one client");
  list.integer(g.strands_per_session_max, "strands_per_client_max", 1, std::int64_t{1} << 40,
               "strands of all grooms of one client");
  list.number(g.upload_bytes_per_s, "upload_bytes_per_s", 1, 1e12, "bytes of grooms from one client, mean");
  list.number(g.upload_burst_bytes, "upload_burst_bytes", 1024, 1e12,
              "bytes of grooms from one client, at once; by default room for four grooms at least");
  list.seconds(g.build_turn_ns, "build_turn_s", 0.1, 86'400,
               "seconds after which a build gives way to one of a client whose builds have taken less");
  list.seconds(g.build_ns_max, "build_seconds_max", 0.1, 86'400, "seconds that one groom may take to build");
  list.integer(g.build_memory_bytes_max, "build_memory_bytes_max", 64 << 20, 1024 * kGiB,
               "bytes that one groom's build may take, in a process of its own");
  list.integer(c.build_threads, "build_threads", 0, 64,
               "threads of a groom's build, of low priority; 0: one for each hardware thread, at most 4");
  list.choice(
      g.learning, "learn_hair",
      "learn hair by example in the background, which crowds need little time for: when characters lack time for "
      "the level that their owners asked for, always, or never",
      {"never", "when_short", "always"});
  list.text(c.groom_cache, "groom_cache",
            "cache uploaded grooms in this folder, so that no client uploads them again; empty: no cache");
  list.integer(c.groom_cache_mib, "groom_cache_mib", 1, 1 << 20,
               "MiB of this cache; it removes the least recently used first");
  list.text(c.level_cache, "level_cache",
            "cache built levels in this folder, so that the next server does not build them; empty: no cache");
  list.integer(c.level_cache_mib, "level_cache_mib", 1, 1 << 20,
               "MiB of this cache; it removes the least recently used first");
  list.text(c.object_store.url, "object_store",
            "share both caches with other servers in this folder of a bucket of S3, MinIO or Ceph: "
            "https://host:9000/bucket/prefix or https://bucket.host/prefix; empty: no store");
  list.text(c.object_store.region, "object_store_region", "region of the bucket, which signatures name").may_be_empty =
      false;
  list.text(c.object_store.key_file, "object_store_key_file",
            "file of two lines, access key and secret; empty: AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY have them");
  list.text(c.object_store.ca, "object_store_ca",
            "PEM file of the authority of the store's certificate; empty: the system's");
  list.integer(g.groom.strand_count_max, "strands_max", 1, of(most.strand_count_max), "of one groom");
  list.number(g.groom.coordinate_max_m, "coordinate_max_m", 0.01, most.coordinate_max_m,
              "every coordinate of a groom, absolute");
}

void add_fleet(List& list, Config& c) {
  FleetConfig& f = c.fleet;
  list.section("fleet");
  list.words(f.etcd.endpoints, "etcd",
             "endpoints of etcd, which tells the servers of a fleet who has which room: http://host:2379 or "
             "https://host:2379; empty: no fleet");
  list.text(f.name, "name", "of the fleet; servers of other names do not see this one").flag = "--fleet-name";
  list.text(f.address, "address",
            "host or host:port by which clients reach this server; agones: as the sidecar of Agones says")
      .flag = "--fleet-address";
  list.text(f.page, "page", "URL of this server's page; empty: none").flag = "--fleet-page";
  list.integer(f.lease_s, "lease_s", 2, 3600,
               "seconds for which etcd keeps the rooms of a server that it does not hear; they stop a little earlier")
      .flag = "--fleet-lease";
  list.choice(
      f.without_etcd, "without_etcd",
      "rooms while no endpoint of etcd answers, after the lease: stop, or go_on, which is safe only if the other "
      "servers do not reach etcd either",
      {"stop", "go_on"});
  list.words(f.big_rooms, "big_rooms",
             "names of rooms that should each have a server of their own; the same for all servers of the fleet");
  list.boolean(f.balance, "balance",
               "while this server is short of time, move rooms that run to servers with free time, one after another")
      .flag = "--fleet-balance";
  list.choice(f.agones, "agones",
              "tell Agones, by its sidecar, that this server is ready, in use or ended: off, on, or auto, which is on "
              "where AGONES_SDK_HTTP_PORT is set",
              {"off", "on", "auto"});
  list.text(f.etcd.ca, "etcd_ca", "PEM file of the authority of etcd's certificates; empty: the system's");
  list.text(f.etcd.certificate, "etcd_certificate", "PEM file, this server's certificate as a client of etcd");
  list.text(f.etcd.key, "etcd_key", "PEM file, the key of this certificate");
  list.text(f.etcd.user, "etcd_user", "user of etcd; empty: none");
  list.text(f.etcd.password_file, "etcd_password_file", "file whose first line is the password of this user");
}

void add_log(List& list, Config& c) {
  list.section("log");
  list.text(c.log_level, "log_level", "lowest level of messages on standard error",
            {"trace", "debug", "info", "warn", "error", "off"});
  list.number(c.counters_interval_s, "counters_interval_s", 0.1, 86'400, "seconds between counters, at level debug");
}

}  // namespace

std::vector<Setting> settings_of(Config& config) {
  // Sections come in the order in which --help and a written file show them.
  List list;
  add_server(list, config);
  add_solver(list, config);
  add_wind(list, config);
  add_props(list, config);
  add_limits(list, config);
  add_transport(list, config);
  add_grooms(list, config);
  add_fleet(list, config);
  add_log(list, config);
  return list.take();
}

}  // namespace hairnet::server
