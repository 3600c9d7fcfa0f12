#include "server/fleet/etcd_api.hpp"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace hairnet::server::etcd {
namespace {

using Json = nlohmann::ordered_json;
// Bounds of texts that etcd sends: an error's message is cut for the log, and a longer token is refused.
constexpr std::size_t kErrorBytesMax = 200, kTokenBytesMax = 4096;

// The JSON gateway takes bytes as base64, since JSON's texts cannot hold all of them.
std::string base64(std::string_view text) {
  std::string coded(sodium_base64_encoded_len(text.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(coded.data(), coded.size(), reinterpret_cast<const unsigned char*>(text.data()), text.size(),
                    sodium_base64_VARIANT_ORIGINAL);
  // Sodium counts the terminating zero.
  coded.pop_back();
  return coded;
}

// JSON's numbers lose digits beyond 2^53 in some programs, so the gateway writes and takes 64 bits as text.
std::string text_of(std::int64_t number) {
  return std::to_string(number);
}

// These functions make the JSON of requests. The names of paths and fields are those of etcd's gRPC gateway (etcd.io,
// "API reference").
Request request(std::string path, const Json& body) {
  return {std::move(path), body.dump()};
}

Json put_of(std::string_view key, std::string_view value, std::int64_t lease) {
  return {{"key", base64(key)}, {"value", base64(value)}, {"lease", text_of(lease)}};
}

// The condition of a transaction: the key was created at this revision; 0: the key does not exist.
Json compare_of(std::string_view key, std::int64_t create_revision) {
  return {
      {"target", "CREATE"}, {"result", "EQUAL"}, {"key", base64(key)}, {"create_revision", text_of(create_revision)}};
}

Json range_of(std::string_view key) {
  return {{"request_range", {{"key", base64(key)}}}};
}

Json remove_of(std::string_view key) {
  return {{"request_delete_range", {{"key", base64(key)}}}};
}

// Appends the change of the second key to a transaction's actions.
void add(Json& actions, const Beside& beside) {
  if (beside.action == Beside::Action::put)
    actions.push_back({{"request_put", put_of(beside.key, beside.value, beside.lease)}});
  else if (beside.action == Beside::Action::remove)
    actions.push_back(remove_of(beside.key));
}

// Reads fields of an object, and remembers the first that is wrong. An absent field is zero, false or empty: the
// gateway leaves out fields with these values. A wrong field does not stop the reading; the caller looks at the error
// once, at the end.
class Fields {
 public:
  Fields(const Json& object, std::string& error) : object_(&object), error_(&error) {
    if (!object.is_object()) fail("an object is expected");
  }

  // A number from 0 on, below 2^63.
  std::int64_t whole(const char* name) {
    const Json* value = find(name);
    if (!value) return 0;
    std::int64_t number = -1;
    // The gateway writes numbers of 64 bits as texts and smaller ones as numbers: both are taken.
    if (value->is_number_unsigned()) {
      const auto big = value->get<std::uint64_t>();
      if (big <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
        number = static_cast<std::int64_t>(big);
    } else if (value->is_string()) {
      const auto& text = value->get_ref<const std::string&>();
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
      if (error != std::errc() || end != text.data() + text.size()) number = -1;
    }
    if (number < 0) fail(fmt::format("{} is not a whole number", name));
    return std::max<std::int64_t>(number, 0);
  }
  bool boolean(const char* name) {
    const Json* value = find(name);
    if (!value) return false;
    if (!value->is_boolean()) {
      fail(fmt::format("{} is not true or false", name));
      return false;
    }
    return value->get<bool>();
  }
  // Bytes that the gateway has coded in base64.
  std::string bytes(const char* name) {
    const Json* value = find(name);
    if (!value) return {};
    if (!value->is_string()) {
      fail(fmt::format("{} is not base64", name));
      return {};
    }
    const auto& coded = value->get_ref<const std::string&>();
    std::string plain(coded.size(), '\0');
    std::size_t length = 0;
    const char* end = nullptr;
    const bool decoded = sodium_base642bin(reinterpret_cast<unsigned char*>(plain.data()), plain.size(), coded.data(),
                                           coded.size(), nullptr, &length, &end, sodium_base64_VARIANT_ORIGINAL) == 0;
    if (!decoded || end != coded.data() + coded.size()) {
      fail(fmt::format("{} is not base64", name));
      return {};
    }
    plain.resize(length);
    return plain;
  }
  std::string word(const char* name) {
    const Json* value = find(name);
    if (!value) return {};
    if (!value->is_string()) {
      fail(fmt::format("{} is not text", name));
      return {};
    }
    return value->get<std::string>();
  }
  // These two return null when the field is absent or of another kind. Another kind is an error.
  const Json* object(const char* name) {
    const Json* value = find(name);
    if (value && !value->is_object()) fail(fmt::format("{} is not an object", name));
    return value && value->is_object() ? value : nullptr;
  }
  const Json* array(const char* name) {
    const Json* value = find(name);
    if (value && !value->is_array()) fail(fmt::format("{} is not an array", name));
    return value && value->is_array() ? value : nullptr;
  }
  void fail(std::string what) {
    if (error_->empty()) *error_ = std::move(what);
  }

 private:
  // Null when the field is absent or null.
  const Json* find(const char* name) const {
    if (!object_->is_object()) return nullptr;
    const auto found = object_->find(name);
    return found == object_->end() || found->is_null() ? nullptr : &*found;
  }

  const Json* object_;
  std::string* error_;
};

// Parses an answer. A text that is too long or no JSON object sets the error and gives an empty object, so that callers
// go on without a branch.
Json parse(std::string_view text, std::string& error) {
  if (text.size() > kAnswerBytesMax) {
    error = "the answer is too long";
    return Json::object();
  }
  // The last argument: no exception for text that is not JSON.
  Json json = Json::parse(text.begin(), text.end(), nullptr, false);
  if (json.is_discarded() || !json.is_object()) {
    error = "the answer is not a JSON object";
    return Json::object();
  }
  return json;
}

// The messages of streams (keep-alive and watch) are inside a field "result".
const Json& result_of(const Json& json, std::string& error) {
  static const Json none = Json::object();
  if (const Json* result = Fields(json, error).object("result")) return *result;
  if (error.empty()) error = "the answer has no result";
  return none;
}

// The revision of the whole store at the time of the answer; zero without a header.
std::int64_t revision_of(Fields& fields, std::string& error) {
  const Json* header = fields.object("header");
  return header ? Fields(*header, error).whole("revision") : 0;
}

// Reads one entry. etcd gives every entry a key and a revision, so their absence is an error.
KeyValue entry_of(const Json& json, std::string& error) {
  Fields fields(json, error);
  KeyValue entry;
  entry.key = fields.bytes("key");
  entry.value = fields.bytes("value");
  entry.is_too_long = entry.key.size() > kKeyBytesMax || entry.value.size() > kValueBytesMax;
  // The entry stays, without its value: its key and revision are needed to skip it by name.
  if (entry.is_too_long) entry.value.clear();
  entry.create_revision = fields.whole("create_revision");
  entry.mod_revision = fields.whole("mod_revision");
  entry.lease = fields.whole("lease");
  if (entry.key.empty()) fields.fail("an entry has no key");
  if (entry.mod_revision == 0) fields.fail("an entry has no revision");
  return entry;
}

// Reads the entries of a range. A deleted entry never appears here, so each must have a creation revision.
std::vector<KeyValue> entries_of(Fields& fields, std::string& error) {
  std::vector<KeyValue> entries;
  if (const Json* list = fields.array("kvs")) {
    for (const Json& item : *list) {
      entries.push_back(entry_of(item, error));
      if (entries.back().create_revision == 0) fields.fail("an entry has no revision");
    }
  }
  return entries;
}

// The answer, or the first error that was met while it was read.
template <class Answer>
Result<Answer> finished(Answer answer, const std::string& error) {
  if (!error.empty()) return Refusal(error);
  return answer;
}

LeaseAnswer lease_of(const Json& json, std::string& error) {
  Fields fields(json, error);
  LeaseAnswer answer{.lease = fields.whole("ID"), .ttl_s = fields.whole("TTL")};
  if (answer.lease == 0) fields.fail("the answer names no lease");
  return answer;
}

}  // namespace

Request grant(std::int64_t ttl_s) {
  return request("/v3/lease/grant", {{"TTL", text_of(ttl_s)}});
}

Request keep_alive(std::int64_t lease) {
  return request("/v3/lease/keepalive", {{"ID", text_of(lease)}});
}

Request revoke(std::int64_t lease) {
  return request("/v3/lease/revoke", {{"ID", text_of(lease)}});
}

Request time_to_live(std::int64_t lease) {
  return request("/v3/lease/timetolive", {{"ID", text_of(lease)}});
}

Request range(std::string_view begin, std::string_view end, std::int64_t limit, std::int64_t revision) {
  return request(
      "/v3/kv/range",
      {{"key", base64(begin)}, {"range_end", base64(end)}, {"limit", text_of(limit)}, {"revision", text_of(revision)}});
}

Request first_key(std::string_view begin, std::string_view end, std::int64_t revision) {
  return request("/v3/kv/range", {{"key", base64(begin)},
                                  {"range_end", base64(end)},
                                  {"limit", text_of(1)},
                                  {"revision", text_of(revision)},
                                  {"keys_only", true}});
}

Request put(std::string_view key, std::string_view value, std::int64_t lease) {
  return request("/v3/kv/put", put_of(key, value, lease));
}

Request claim(std::string_view key, std::string_view value, std::int64_t lease, std::string_view beside) {
  // A creation revision of 0 means that the key does not exist. etcd compares and puts in one step, so of two servers
  // that claim at once exactly one succeeds.
  Json success = Json::array({{{"request_put", put_of(key, value, lease)}}}), failure = Json::array({range_of(key)});
  if (!beside.empty())
    for (Json* actions : {&success, &failure}) actions->push_back(range_of(beside));
  return request("/v3/kv/txn",
                 {{"compare", Json::array({compare_of(key, 0)})}, {"success", success}, {"failure", failure}});
}

// A release that arrives late finds another creation revision, and removes nothing.
Request remove(std::string_view key, std::int64_t create_revision, const Beside& beside) {
  Json actions = Json::array({remove_of(key)});
  add(actions, beside);
  return request("/v3/kv/txn", {{"compare", Json::array({compare_of(key, create_revision)})}, {"success", actions}});
}

Request put_beside(std::string_view key, std::int64_t create_revision, const Beside& beside) {
  Json actions = Json::array();
  add(actions, beside);
  return request("/v3/kv/txn", {{"compare", Json::array({compare_of(key, create_revision)})}, {"success", actions}});
}

// With progress_notify etcd tells its revision now and then while nothing changes, so the copy does not fall behind a
// compaction.
Request watch(std::string_view begin, std::string_view end, std::int64_t start_revision) {
  return request("/v3/watch", {{"create_request",
                                {{"key", base64(begin)},
                                 {"range_end", base64(end)},
                                 {"start_revision", text_of(start_revision)},
                                 {"progress_notify", true}}}});
}

Request authenticate(std::string_view user, std::string_view password) {
  // `replace`: a password may have bytes that are no UTF-8, for which dump() would throw.
  const Json body{{"name", user}, {"password", password}};
  return {"/v3/auth/authenticate", body.dump(-1, ' ', true, Json::error_handler_t::replace)};
}

std::string end_of(std::string_view prefix) {
  std::string end(prefix);
  // 0xff has no successor in one byte, so the byte before it counts up.
  while (!end.empty() && static_cast<unsigned char>(end.back()) == 0xff) end.pop_back();
  if (!end.empty()) ++end.back();
  return end;
}

Result<LeaseAnswer> parse_grant(std::string_view text) {
  std::string error;
  const Json json = parse(text, error);
  LeaseAnswer answer = lease_of(json, error);
  if (error.empty() && answer.ttl_s == 0) error = "the lease has no time";
  return finished(answer, error);
}

Result<LeaseAnswer> parse_keep_alive(std::string_view text) {
  std::string error;
  const Json json = parse(text, error);
  return finished(lease_of(result_of(json, error), error), error);
}

// etcd rounds the seconds that are left down, also to none; -1: the lease does not exist.
Result<LeaseAnswer> parse_time_to_live(std::string_view text) {
  std::string error;
  Json json = parse(text, error);
  const auto ttl = json.find("TTL");
  const bool is_gone = ttl != json.end() && *ttl == "-1";
  if (is_gone) json.erase(ttl);
  LeaseAnswer answer = lease_of(json, error);
  if (!is_gone) answer.ttl_s = std::max<std::int64_t>(answer.ttl_s, 1);
  return finished(answer, error);
}

Result<std::int64_t> parse_put(std::string_view text) {
  std::string error;
  const Json json = parse(text, error);
  Fields fields(json, error);
  const std::int64_t revision = revision_of(fields, error);
  if (revision == 0) fields.fail("the answer has no revision");
  return finished(revision, error);
}

Result<RangeAnswer> parse_range(std::string_view text) {
  std::string error;
  const Json json = parse(text, error);
  Fields fields(json, error);
  RangeAnswer answer;
  answer.revision = revision_of(fields, error);
  if (answer.revision == 0) fields.fail("the answer has no revision");
  answer.entries = entries_of(fields, error);
  answer.has_more = fields.boolean("more");
  return finished(std::move(answer), error);
}

Result<TxnAnswer> parse_txn(std::string_view text) {
  std::string error;
  const Json json = parse(text, error);
  Fields fields(json, error);
  TxnAnswer answer;
  answer.revision = revision_of(fields, error);
  if (answer.revision == 0) fields.fail("the answer has no revision");
  answer.succeeded = fields.boolean("succeeded");
  if (const Json* responses = fields.array("responses")) {
    for (const Json& response : *responses) {
      const Json* range = Fields(response, error).object("response_range");
      if (!range) continue;
      Fields range_fields(*range, error);
      for (KeyValue& entry : entries_of(range_fields, error)) answer.found.push_back(std::move(entry));
    }
  }
  return finished(std::move(answer), error);
}

Result<WatchAnswer> parse_watch(std::string_view line) {
  std::string error;
  const Json json = parse(line, error);
  const Json& result = result_of(json, error);
  Fields fields(result, error);
  WatchAnswer answer;
  answer.revision = revision_of(fields, error);
  answer.is_created = fields.boolean("created");
  answer.is_canceled = fields.boolean("canceled");
  answer.compact_revision = fields.whole("compact_revision");
  if (const Json* events = fields.array("events")) {
    for (const Json& event : *events) {
      Fields event_fields(event, error);
      const std::string type = event_fields.word("type");
      if (!type.empty() && type != "PUT" && type != "DELETE") event_fields.fail("an event is of no known type");
      const Json* entry = event_fields.object("kv");
      if (!entry) {
        event_fields.fail("an event has no entry");
        break;
      }
      answer.changes.push_back({.is_deleted = type == "DELETE", .entry = entry_of(*entry, error)});
      if (type != "DELETE" && answer.changes.back().entry.create_revision == 0)
        event_fields.fail("an entry has no revision");
    }
  }
  return finished(std::move(answer), error);
}

Result<std::string> parse_token(std::string_view text) {
  std::string error;
  const Json json = parse(text, error);
  std::string token = Fields(json, error).word("token");
  // The token goes into a header line of each request: a line break in it would add headers.
  const bool is_valid = !token.empty() && token.size() <= kTokenBytesMax &&
                        std::ranges::all_of(token, [](char c) { return c > ' ' && c <= '~'; });
  if (error.empty() && !is_valid) error = "the answer has no token";
  return finished(std::move(token), error);
}

std::string parse_error(std::string_view text) {
  std::string error;
  const Json json = parse(text, error);
  for (const char* name : {"message", "error"}) {
    const auto found = json.find(name);
    if (found != json.end() && found->is_string()) return found->get<std::string>().substr(0, kErrorBytesMax);
  }
  return {};
}

bool is_lease_gone(int status, std::string_view text) {
  // A 404 alone may come from a proxy. To take it for a lost lease would give up all rooms.
  return status == 404 && parse_error(text).find("requested lease not found") != std::string::npos;
}

}  // namespace hairnet::server::etcd
