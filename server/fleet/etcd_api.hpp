#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.hpp"

// Requests and answers of etcd 3.4's JSON gateway, as text. Keys and values are base64 there, and 64-bit numbers are
// text; fields that are zero, false or empty are left out.
namespace hairnet::server::etcd {

// Bounds of what this server accepts from etcd, because other programs may write there too: a whole answer, and one key
// and one value. A value of this server is shorter (kKeptBytesMax in fleet_values.hpp).
inline constexpr std::size_t kAnswerBytesMax = std::size_t{4} << 20;
inline constexpr std::size_t kKeyBytesMax = 512, kValueBytesMax = std::size_t{64} << 10;

// A POST to etcd's JSON gateway: the path, and the body as text. Keys and values travel in base64, numbers of 64 bits
// as texts.
struct Request {
  std::string path, body;
};

// Makes a lease that lasts `ttl_s` seconds without a keep-alive.
Request grant(std::int64_t ttl_s);
// Gives the lease its full time again.
Request keep_alive(std::int64_t lease);
// Ends the lease, and deletes all its keys with it.
Request revoke(std::int64_t lease);
// Asks whether the lease exists, and does not prolong it.
Request time_to_live(std::int64_t lease);
// Asks for the keys from `begin` up to but without `end`; `revision` 0 is the newest state.
Request range(std::string_view begin, std::string_view end, std::int64_t limit, std::int64_t revision);
// Asks for the first of these keys, without its value: for a list that a value makes too long.
Request first_key(std::string_view begin, std::string_view end, std::int64_t revision);
// Puts the key under the lease, whatever it was before.
Request put(std::string_view key, std::string_view value, std::int64_t lease);
// Puts the key under the lease if the key does not exist; else reads it. In both cases the same transaction also reads
// the key `beside`, unless `beside` is empty.
Request claim(std::string_view key, std::string_view value, std::int64_t lease, std::string_view beside);
// A transaction is about one key, here a room's, and may change a second one, here the room's text under `kept`. The
// two changes happen together or not at all. This is the change of the second key.
struct Beside {
  enum class Action : std::uint8_t { none, put, remove };
  Action action = Action::none;
  std::string key = {}, value = {};
  std::int64_t lease = 0;
};
// Deletes `key`, and makes the change `beside`, if `key` still is the one that was created at this revision.
Request remove(std::string_view key, std::int64_t create_revision, const Beside& beside);
// Makes the change `beside` if `key` still is the one that was created at this revision; leaves `key` as it is.
Request put_beside(std::string_view key, std::int64_t create_revision, const Beside& beside);
// All changes from this revision on, as a stream.
Request watch(std::string_view begin, std::string_view end, std::int64_t start_revision);
// Asks for a token of a user, which other requests then carry.
Request authenticate(std::string_view user, std::string_view password);
// The first key behind all keys that begin with `prefix`.
std::string end_of(std::string_view prefix);

struct KeyValue {
  std::string key, value;
  std::int64_t create_revision = 0, mod_revision = 0, lease = 0;
  // The key exceeds kKeyBytesMax, or the value exceeds kValueBytesMax; the value is left out.
  bool is_too_long = false;
};
struct LeaseAnswer {
  // Without a time the lease does not exist.
  std::int64_t lease = 0, ttl_s = 0;
};
struct RangeAnswer {
  std::int64_t revision = 0;
  std::vector<KeyValue> entries;
  bool has_more = false;
};
struct TxnAnswer {
  std::int64_t revision = 0;
  bool succeeded = false;
  // The keys that the transaction has read, as far as they exist.
  std::vector<KeyValue> found;
};
struct Change {
  bool is_deleted = false;
  // A deleted entry has its key, and the revision of the deletion as mod_revision.
  KeyValue entry;
};
struct WatchAnswer {
  std::int64_t revision = 0;
  bool is_created = false, is_canceled = false;
  // The watch began before this revision, and what came before it is lost.
  std::int64_t compact_revision = 0;
  std::vector<Change> changes;
};

// Each returns the answer, or one line that says what is wrong with the text.
Result<LeaseAnswer> parse_grant(std::string_view text);
Result<LeaseAnswer> parse_keep_alive(std::string_view text);
Result<LeaseAnswer> parse_time_to_live(std::string_view text);
// The answer is the revision of the put.
Result<std::int64_t> parse_put(std::string_view text);
Result<RangeAnswer> parse_range(std::string_view text);
Result<TxnAnswer> parse_txn(std::string_view text);
Result<WatchAnswer> parse_watch(std::string_view line);

Result<std::string> parse_token(std::string_view text);

// etcd's own words in an answer with an error status; empty when the text has none. At most 200 bytes.
std::string parse_error(std::string_view text);
// The error says that the lease does not exist.
bool is_lease_gone(int status, std::string_view text);

}  // namespace hairnet::server::etcd
