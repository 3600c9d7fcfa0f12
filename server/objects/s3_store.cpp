#include "server/objects/s3_store.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <utility>

#include "core/assert.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

using Outcome = ObjectAnswer::Outcome;

// A longer text in <Code> is no error code of S3, whose codes are short words.
constexpr std::size_t kCodeBytesMax = 64;

const char* verb_of(ExchangeRequest::Method method) {
  switch (method) {
    case ExchangeRequest::Method::get:
      return "GET";
    case ExchangeRequest::Method::head:
      return "HEAD";
    case ExchangeRequest::Method::put:
      break;
  }
  return "PUT";
}

// Returns the content of <Code> in the XML of an error; empty when there is none. Only letters are accepted, because
// the log gets the code.
std::string code_of(std::span<const std::uint8_t> body) {
  constexpr std::string_view kBegin = "<Code>", kEnd = "</Code>";
  const std::string_view text(reinterpret_cast<const char*>(body.data()), body.size());
  const std::size_t begin = text.find(kBegin);
  if (begin == text.npos) return {};
  const std::size_t end = text.find(kEnd, begin);
  if (end == text.npos) return {};
  const std::string_view code = text.substr(begin + kBegin.size(), end - begin - kBegin.size());
  const bool is_word =
      code.size() <= kCodeBytesMax && std::ranges::all_of(code, [](unsigned char c) { return std::isalnum(c) != 0; });
  return is_word ? std::string(code) : std::string();
}

// How a failed call is logged and counted, and what its caller gets.
struct Failure {
  const char* reason;
  Counter* counter;
  Outcome outcome;
};

Failure failure_of(const ExchangeAnswer& answer, ObjectCounters& c) {
  switch (answer.error) {
    case ExchangeError::unreachable:
      return {"unreachable", &c.requests_failed_unreachable, Outcome::unreachable};
    case ExchangeError::timeout:
      return {"timeout", &c.requests_failed_timeout, Outcome::unreachable};
    case ExchangeError::broken:
      return {"broken", &c.requests_failed_broken, Outcome::unreachable};
    case ExchangeError::malformed:
    // Only the answer to a get with status 200 may be long (HttpExchange::call), so this is an error with too long a
    // body.
    case ExchangeError::oversize:
      return {"malformed", &c.requests_failed_malformed, Outcome::unreachable};
    case ExchangeError::cancelled:
    case ExchangeError::none:
      break;
  }
  // With these statuses the store cannot answer now, and may do so later. The statuses below mean a refusal, which the
  // same request would get again.
  if (answer.status >= 500 || answer.status == 429) return {"error", &c.requests_failed_error, Outcome::unreachable};
  if (answer.status == 401 || answer.status == 403) return {"denied", &c.requests_failed_denied, Outcome::refused};
  if (answer.status >= 300 && answer.status < 400)
    return {"redirected", &c.requests_failed_redirected, Outcome::refused};
  return {"refused", &c.requests_failed_refused, Outcome::refused};
}

}  // namespace

S3Store::S3Store(S3StoreDef def, HttpExchange& exchange, ObjectCounters& counters)
    : def_(std::move(def)), exchange_(&exchange), counters_(&counters) {
  HAIRNET_ASSERT(def_.path.starts_with('/') && def_.path.ends_with('/'));
  HAIRNET_ASSERT(def_.unix_time_s && def_.now_ns);
  all_.closed_until_ns = gets_.closed_until_ns = puts_.closed_until_ns = std::numeric_limits<std::int64_t>::min();
}

ObjectAnswer S3Store::get(std::string_view name, std::size_t bytes_max) {
  const std::lock_guard lock(mutex_);
  // The check is repeated under the lock: the call that had the lock before may have found that the store does not
  // answer.
  if (!takes_gets()) return skip();
  ExchangeAnswer answer = call(ExchangeRequest::Method::get, name, {}, bytes_max);
  // The store works, but the object exceeds the caller's bound.
  if (answer.error == ExchangeError::oversize && answer.status == 200) {
    succeed(gets_);
    return {Outcome::too_large, {}, fmt::format("more than {} bytes", bytes_max)};
  }
  if (answer.error == ExchangeError::none && answer.status == 200) {
    succeed(gets_);
    return {Outcome::read, std::move(answer.body), {}};
  }
  // A missing object is usual; a missing bucket is an error of the settings, with the same status.
  if (answer.error == ExchangeError::none && answer.status == 404 && code_of(answer.body) != "NoSuchBucket") {
    succeed(gets_);
    return {Outcome::absent, {}, {}};
  }
  return fail(gets_, answer);
}

ObjectAnswer S3Store::put(std::string_view name, std::span<const std::uint8_t> bytes, Existing existing) {
  const std::lock_guard lock(mutex_);
  if (!takes_puts()) return skip();
  // A head request is small, and saves sending the megabytes of an object that exists. Two servers may still both send
  // the object, which does no harm: objects of one name are interchangeable.
  if (existing == Existing::keep) {
    const ExchangeAnswer answer = call(ExchangeRequest::Method::head, name, {}, 0);
    if (answer.error == ExchangeError::none && answer.status == 200) {
      succeed(puts_);
      return {Outcome::kept, {}, {}};
    }
    if (answer.error != ExchangeError::none || answer.status != 404) return fail(puts_, answer);
  }
  const ExchangeAnswer answer = call(ExchangeRequest::Method::put, name, bytes, 0);
  if (answer.error != ExchangeError::none || answer.status < 200 || answer.status >= 300) return fail(puts_, answer);
  succeed(puts_);
  return {Outcome::stored, {}, {}};
}

void S3Store::cancel() {
  cancelled_ = true;
  exchange_->cancel();
}

bool S3Store::is_open(const Calls& calls) const {
  return !cancelled_ && def_.now_ns() >= calls.closed_until_ns;
}

ExchangeAnswer S3Store::call(ExchangeRequest::Method method, std::string_view name, std::span<const std::uint8_t> body,
                             std::size_t bytes_max) {
  counters_->requests.add();
  // Each call is signed for its own time: the store refuses a signature that is some minutes old.
  const std::string date = s3_date(def_.unix_time_s());
  ExchangeRequest request{.method = method, .target = def_.path + std::string(name), .fields = {}, .body = body};
  const std::string payload_hash = sha256_hex(body);
  // The signature covers these fields and the body's hash, sorted by name. Fields that the client adds later are not
  // covered.
  request.fields = {{"host", def_.host}, {"x-amz-content-sha256", payload_hash}, {"x-amz-date", date}};
  const std::string authorization = s3_authorization(
      {.method = verb_of(method), .path = request.target, .fields = request.fields, .payload_hash = payload_hash},
      def_.keys, def_.region, date);
  request.fields.emplace_back("authorization", authorization);
  return exchange_->call(request, bytes_max);
}

ObjectAnswer S3Store::skip() {
  if (!cancelled_) counters_->requests_skipped.add();
  return {Outcome::unreachable, {}, "it is left alone after a failure"};
}

ObjectAnswer S3Store::fail(Calls& calls, const ExchangeAnswer& answer) {
  if (answer.error == ExchangeError::cancelled) return {Outcome::unreachable, {}, "the server is stopping"};
  const Failure failure = failure_of(answer, *counters_);
  failure.counter->add();
  const std::string code = code_of(answer.body);
  const std::string detail = answer.error != ExchangeError::none
                                 ? answer.detail
                                 : fmt::format("status {}{}{}", answer.status, code.empty() ? "" : " ", code);
  // A refusal is an answer, so the store can be reached.
  if (failure.outcome == Outcome::refused) succeed(all_);
  close(failure.outcome == Outcome::refused ? calls : all_, failure.reason, detail);
  return {failure.outcome, {}, std::string(failure.reason) + ": " + detail};
}

void S3Store::close(Calls& calls, const std::string& reason, const std::string& detail) {
  calls.closed_until_ns = def_.now_ns() + def_.pause_ns;
  counters_->gauges.object_store_up.set(0);
  // The same failure again is counted and not logged.
  if (std::exchange(calls.failure, reason) == reason) return;
  spdlog::warn("event=object_store_failed store={} calls={} reason={} detail={}", log_text(def_.url), calls.name,
               reason, log_text(detail));
}

void S3Store::succeed(Calls& calls) {
  for (Calls* answered : {&all_, &calls}) {
    if (!std::exchange(answered->failure, {}).empty())
      spdlog::warn("event=object_store_reached store={} calls={}", log_text(def_.url), answered->name);
  }
  // The gauge stays 0 while gets or puts alone are refused.
  counters_->gauges.object_store_up.set(gets_.failure.empty() && puts_.failure.empty() ? 1 : 0);
}

}  // namespace hairnet::server
