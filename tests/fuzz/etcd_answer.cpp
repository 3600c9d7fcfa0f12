#include "server/fleet/etcd_api.hpp"
#include "server/fleet/fleet_values.hpp"
#include "tests/fuzz/target.hpp"

// Any text of etcd is refused with a reason, or gives values within their bounds. A status that is accepted comes back
// as it was. The first byte says what the text is.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  using namespace hairnet::server;
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto check = [](const etcd::KeyValue& entry) {
    fuzz::require(!entry.key.empty() && (entry.is_too_long || entry.key.size() <= etcd::kKeyBytesMax), "a key");
    fuzz::require(entry.value.size() <= etcd::kValueBytesMax && entry.mod_revision > 0, "an entry");
  };
  const auto refused = [](const auto& answer) {
    fuzz::require(answer.has_value() || !answer.error().empty(), "a reason");
    return !answer.has_value();
  };
  switch (data[0] % 7) {
    case 0: {
      const auto answer = etcd::parse_grant(text);
      if (!refused(answer)) fuzz::require(answer->lease > 0 && answer->ttl_s > 0, "a lease");
      break;
    }
    case 1: {
      for (const auto& answer : {etcd::parse_keep_alive(text), etcd::parse_time_to_live(text)})
        if (!refused(answer)) fuzz::require(answer->lease > 0 && answer->ttl_s >= 0, "a lease");
      break;
    }
    case 2: {
      const auto answer = etcd::parse_range(text);
      if (refused(answer)) break;
      for (const etcd::KeyValue& entry : answer->entries) check(entry);
      break;
    }
    case 3: {
      const auto answer = etcd::parse_txn(text);
      if (refused(answer)) break;
      for (const etcd::KeyValue& entry : answer->found) check(entry);
      break;
    }
    case 4: {
      const auto answer = etcd::parse_watch(text);
      if (refused(answer)) break;
      for (const etcd::Change& change : answer->changes) check(change.entry);
      break;
    }
    case 5:
      fuzz::require(etcd::parse_error(text).size() <= 200, "a short error");
      refused(etcd::parse_put(text));
      refused(etcd::parse_token(text));
      break;
    default: {
      const auto status = parse_status(text);
      if (refused(status)) break;
      const auto again = parse_status(to_value(*status));
      fuzz::require(again && *again == *status, "the same status again");
    }
  }
  return 0;
}
