#include "server/app/shared_objects.hpp"

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <string_view>
#include <utility>

#include "server/files/files.hpp"
#include "server/objects/s3_store.hpp"
#include "server/transport/blocking_http_client.hpp"

namespace hairnet::server {
namespace {

// The longest key and the longest file of keys that are accepted.
constexpr std::size_t kKeyBytesMax = 256, kKeyFileBytesMax = 4096;

// Without spaces and control characters: it becomes a part of a header.
bool is_key(const std::string& key) {
  return !key.empty() && key.size() <= kKeyBytesMax &&
         std::ranges::all_of(key, [](unsigned char c) { return c > ' ' && c < 0x7f; });
}

}  // namespace

Result<S3Keys> read_s3_keys(const std::string& file, const std::function<const char*(const char*)>& variable) {
  S3Keys keys;
  if (!file.empty()) {
    const Result<std::string> text = read_text_file(file, kKeyFileBytesMax);
    if (!text) return Refusal("the key file of the object store, " + file + ": " + text.error());
    std::string_view lines = *text;
    // Two lines without names are simple to mount as a secret.
    keys.access = take_line(lines);
    keys.secret = take_line(lines);
    if (!is_key(keys.access) || !is_key(keys.secret))
      return Refusal("the key file of the object store, " + file + ", is not two lines: access key and secret");
    return keys;
  }
  // The usual tools of S3 read the same variables, and containers get secrets by them.
  const char* access = variable("AWS_ACCESS_KEY_ID");
  const char* secret = variable("AWS_SECRET_ACCESS_KEY");
  if (access) keys.access = access;
  if (secret) keys.secret = secret;
  if (!is_key(keys.access) || !is_key(keys.secret))
    return Refusal(
        "grooms.object_store needs grooms.object_store_key_file, or AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY in the "
        "environment");
  return keys;
}

SharedObjects::SharedObjects() = default;

SharedObjects::~SharedObjects() = default;

ObjectStore& SharedObjects::store() {
  return *store_;
}

Result<std::unique_ptr<SharedObjects>> SharedObjects::create(const S3Options& options, ObjectCounters& counters,
                                                             std::function<std::int64_t()> now_ns) {
  if (std::string wrong = validate(options); !wrong.empty()) return Refusal(std::move(wrong));
  if (options.url.empty()) return std::unique_ptr<SharedObjects>();
  Result<S3Keys> keys = read_s3_keys(options.key_file, [](const char* name) { return std::getenv(name); });
  if (!keys) return Refusal(keys.error());
  // validate() has parsed the URL already.
  S3Endpoint endpoint = *parse_s3_endpoint(options.url);
  auto client = BlockingHttpClient::create({.host = std::move(endpoint.host),
                                            .port = endpoint.port,
                                            .is_tls = endpoint.is_tls,
                                            .ca = options.ca,
                                            .whose = "the object store"});
  if (!client) return Refusal(client.error());
  std::unique_ptr<SharedObjects> made(new SharedObjects);
  made->client_ = std::move(*client);
  made->store_ =
      std::make_unique<S3Store>(S3StoreDef{.url = options.url,
                                           .host = std::move(endpoint.host_field),
                                           .path = std::move(endpoint.path),
                                           .region = options.region,
                                           .keys = std::move(*keys),
                                           .unix_time_s = [] { return static_cast<std::int64_t>(std::time(nullptr)); },
                                           .now_ns = std::move(now_ns)},
                                *made->client_, counters);
  return made;
}

}  // namespace hairnet::server
