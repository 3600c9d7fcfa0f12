#include "server/grooms/cache_objects.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <utility>

#include "core/assert.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

// At most kWaitingMax files wait to be put. Beyond, a put is counted and left out: the groom is offered again at its
// next use. stored_ and rejected_ have at most kNotedMax names.
constexpr std::size_t kWaitingMax = 1024, kNotedMax = 65'536;

// Adds the groom to the set. A set that is full forgets everything, which costs a request for each groom again.
void note(std::set<wire::GroomHash>& set, const wire::GroomHash& groom) {
  if (set.size() >= kNotedMax) set.clear();
  set.insert(groom);
}

}  // namespace

CacheObjects::CacheObjects(CacheObjectsDef def, ObjectStore& store, ObjectCounters& counters)
    : def_(std::move(def)), store_(&store), counters_(&counters) {
  HAIRNET_ASSERT(def_.bytes_max > 0);
  HAIRNET_ASSERT(def_.read && def_.absent && def_.stored && def_.kept && def_.rejected);
}

std::optional<std::vector<std::uint8_t>> CacheObjects::get(const wire::GroomHash& groom) {
  ObjectAnswer answer = store_->get(name_of(groom), def_.bytes_max);
  if (answer.outcome == ObjectAnswer::Outcome::read) return std::move(answer.bytes);
  if (answer.outcome == ObjectAnswer::Outcome::absent) def_.absent->add();
  if (answer.outcome == ObjectAnswer::Outcome::too_large) reject(groom, answer.reason, counters_->rejected_size);
  return std::nullopt;
}

void CacheObjects::accept(const wire::GroomHash& groom, std::size_t bytes) {
  def_.read->add();
  counters_->bytes_read.add(bytes);
  note_stored(groom);
}

void CacheObjects::reject(const wire::GroomHash& groom, const std::string& detail) {
  reject(groom, detail, *def_.rejected);
}

void CacheObjects::reject(const wire::GroomHash& groom, const std::string& detail, Counter& counter) {
  counter.add();
  spdlog::info("event=object_rejected object={} detail={}", name_of(groom), log_text(detail));
  const std::lock_guard lock(mutex_);
  note(rejected_, groom);
  stored_.erase(groom);
}

void CacheObjects::offer(const wire::GroomHash& groom, Existing existing) {
  const std::lock_guard lock(mutex_);
  // The store keeps an existing object by default, so a damaged one would stay there for good.
  if (rejected_.contains(groom)) existing = Existing::replace;
  if (existing == Existing::keep && stored_.contains(groom)) return;
  if (waiting_.size() >= kWaitingMax && !waiting_.contains(groom)) return counters_->puts_dropped_full.add();
  Existing& waits = waiting_.try_emplace(groom, existing).first->second;
  if (existing == Existing::replace) waits = existing;
}

std::optional<CacheObjects::Wanted> CacheObjects::take() {
  if (!store_->takes_puts()) return std::nullopt;
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  const auto first = waiting_.extract(waiting_.begin());
  return Wanted{first.key(), first.mapped()};
}

void CacheObjects::put(const Wanted& wanted, std::span<const std::uint8_t> bytes) {
  const ObjectAnswer answer = store_->put(name_of(wanted.groom), bytes, wanted.existing);
  switch (answer.outcome) {
    case ObjectAnswer::Outcome::stored:
      def_.stored->add();
      counters_->bytes_stored.add(bytes.size());
      return note_stored(wanted.groom);
    case ObjectAnswer::Outcome::kept:
      def_.kept->add();
      return note_stored(wanted.groom);
    case ObjectAnswer::Outcome::unreachable:
      // The store is away: the file waits again, and take() gives it out when the store takes puts.
      return offer(wanted.groom, wanted.existing);
    case ObjectAnswer::Outcome::refused:
    case ObjectAnswer::Outcome::too_large:
    case ObjectAnswer::Outcome::read:
    case ObjectAnswer::Outcome::absent:
      break;
  }
  counters_->puts_dropped_refused.add();
}

std::size_t CacheObjects::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_.size();
}

std::string CacheObjects::name_of(const wire::GroomHash& groom) const {
  return fmt::format("{:02x}{}", fmt::join(groom, ""), def_.suffix);
}

void CacheObjects::note_stored(const wire::GroomHash& groom) {
  const std::lock_guard lock(mutex_);
  rejected_.erase(groom);
  note(stored_, groom);
}

}  // namespace hairnet::server
