#include "server/session/downloads.hpp"

#include <algorithm>
#include <span>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

using wire::ErrorReason;

constexpr const char* kNotHere = "the groom is not here";
constexpr const char* kBeyondEnd = "beyond the groom's end";

}  // namespace

// Only the first groom may be on its way from the disk.
void Downloads::check_invariants() const {
  HAIRNET_ASSERT(waiting_.size() <= limits_->downloads_per_session_max);
  for (std::size_t i = 0; i < waiting_.size(); ++i) {
    HAIRNET_VALIDATE(i == 0 || (!waiting_[i].is_fetching && !waiting_[i].is_gone));
    HAIRNET_VALIDATE(!waiting_[i].bytes || (!waiting_[i].is_fetching && !waiting_[i].is_gone));
  }
}

Refused Downloads::add(const wire::GroomRequest& request) {
  if (std::ranges::any_of(waiting_, [&](const Download& d) { return d.hash == request.hash; })) return {};
  auto bytes = groom_service_->bytes(request.hash);
  if (!bytes && !groom_service_->is_cached(request.hash)) return {ErrorReason::groom_unavailable, kNotHere};
  if (bytes && request.offset > bytes->size()) return {ErrorReason::groom_unavailable, kBeyondEnd};
  if (waiting_.size() >= limits_->downloads_per_session_max)
    return {ErrorReason::limit_exceeded, "too many grooms are asked for at once"};
  waiting_.push_back({request.hash, request.offset, std::move(bytes)});
  check_invariants();
  return {};
}

std::optional<wire::Message> Downloads::next(SessionId session, std::int64_t now_ns) {
  if (waiting_.empty() || waiting_.front().is_fetching) return std::nullopt;
  Download& download = waiting_.front();
  if (!download.bytes && !download.is_gone) download.bytes = groom_service_->bytes(download.hash);
  if (!download.bytes && !download.is_gone && groom_service_->fetch(session, download.hash)) {
    download.is_fetching = true;
    return std::nullopt;
  }
  if (!download.bytes || download.offset > download.bytes->size()) {
    const wire::Error error{ErrorReason::groom_unavailable, 0, download.hash, download.bytes ? kBeyondEnd : kNotHere};
    counters_->requests_refused_download.add();
    waiting_.pop_front();
    return error;
  }
  wire::GroomData data{download.hash, download.bytes->size(), download.offset, {}};
  const auto rest = std::span(*download.bytes).subspan(download.offset);
  const auto piece = rest.first(std::min(rest.size(), kPiece_bytes));
  if (!bytes_.take(static_cast<double>(piece.size()), now_ns)) {
    counters_->downloads_delayed.add();
    return std::nullopt;
  }
  data.bytes.assign(piece.begin(), piece.end());
  download.offset += piece.size();
  HAIRNET_ASSERT(download.offset <= download.bytes->size());
  counters_->download_bytes_sent.add(piece.size());
  if (download.offset == download.bytes->size()) waiting_.pop_front();
  return data;
}

bool Downloads::on_read(const wire::GroomHash& groom, std::shared_ptr<const std::vector<std::uint8_t>> bytes) {
  if (waiting_.empty() || waiting_.front().hash != groom || !waiting_.front().is_fetching) return false;
  Download& download = waiting_.front();
  download.is_fetching = false;
  download.is_gone = bytes == nullptr;
  download.bytes = std::move(bytes);
  check_invariants();
  return true;
}

}  // namespace hairnet::server
