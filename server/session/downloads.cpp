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

// Only the first kStreamsMax downloads may be read from disk or have a stream, and a download has no bytes while it is
// being read or after its file has vanished.
void Downloads::check_invariants() const {
  HAIRNET_ASSERT(waiting_.size() <= limits_->downloads_per_session_max);
  for (std::size_t i = 0; i < waiting_.size(); ++i) {
    HAIRNET_VALIDATE(i < kStreamsMax || (!waiting_[i].is_fetching && !waiting_[i].is_gone && !waiting_[i].stream));
    HAIRNET_VALIDATE(!waiting_[i].bytes || (!waiting_[i].is_fetching && !waiting_[i].is_gone));
  }
}

Refused Downloads::add(const wire::GroomRequest& request) {
  // A repeated request costs its price only: a client that asks in a loop does not get the file twice.
  if (std::ranges::any_of(waiting_, [&](const Download& d) { return d.hash == request.hash; })) return {};
  auto bytes = groom_service_->bytes(request.hash);
  // is_cached() answers from memory, without the disk. The file itself is read when its turn comes, so that many
  // requests do not fill the memory.
  if (!bytes && !groom_service_->is_cached(request.hash)) return {ErrorReason::groom_unavailable, kNotHere};
  if (bytes && request.offset > bytes->size()) return {ErrorReason::groom_unavailable, kBeyondEnd};
  if (waiting_.size() >= limits_->downloads_per_session_max)
    return {ErrorReason::limit_exceeded, "too many grooms are asked for at once"};
  waiting_.push_back({request.hash, request.offset, std::move(bytes)});
  check_invariants();
  return {};
}

bool Downloads::has_answer(Download& download, SessionId session) {
  if (download.is_fetching) return false;
  if (download.bytes || download.is_gone) return true;
  // The groom may have come into memory since the request, for example because another session has uploaded it.
  download.bytes = groom_service_->bytes(download.hash);
  if (!download.bytes) download.is_fetching = groom_service_->fetch(session, download.hash);
  return !download.is_fetching;
}

std::optional<wire::Error> Downloads::refusal_of(const Download& download) {
  HAIRNET_ASSERT(!download.is_fetching);
  if (download.bytes && download.offset <= download.bytes->size()) return std::nullopt;
  counters_->requests_refused_download.add();
  return wire::Error{ErrorReason::groom_unavailable, 0, download.hash, download.bytes ? kBeyondEnd : kNotHere};
}

std::optional<wire::GroomData> Downloads::take_piece(Download& download, std::int64_t now_ns) {
  HAIRNET_ASSERT(download.bytes && download.offset <= download.bytes->size());
  wire::GroomData data{download.hash, download.bytes->size(), download.offset, {}};
  const auto rest = std::span(*download.bytes).subspan(download.offset);
  const auto piece = rest.first(std::min(rest.size(), kPiece_bytes));
  // A piece that the bucket refuses stays where it is: the next poll or flush tries again, and nothing is lost.
  if (!bytes_.take(static_cast<double>(piece.size()), now_ns)) {
    counters_->downloads_delayed.add();
    return std::nullopt;
  }
  data.bytes.assign(piece.begin(), piece.end());
  download.offset += piece.size();
  HAIRNET_ASSERT(download.offset <= download.bytes->size());
  counters_->download_bytes_sent.add(piece.size());
  return data;
}

std::optional<wire::Message> Downloads::next(SessionId session, std::int64_t now_ns) {
  // A groom that is read from disk holds up those behind it, so that grooms come in the order of their requests.
  if (waiting_.empty() || !has_answer(waiting_.front(), session)) return std::nullopt;
  Download& download = waiting_.front();
  if (auto refusal = refusal_of(download)) {
    waiting_.pop_front();
    return std::move(*refusal);
  }
  auto data = take_piece(download, now_ns);
  if (!data) return std::nullopt;
  if (is_done(download)) waiting_.pop_front();
  return std::move(*data);
}

std::optional<std::variant<Downloads::Piece, wire::Error>> Downloads::next_on_stream(Connection& connection,
                                                                                     SessionId session,
                                                                                     std::int64_t now_ns) {
  // Only the first kStreamsMax downloads take part, in turn, so one slow stream holds up none of the others.
  const std::size_t count = std::min(waiting_.size(), kStreamsMax);
  for (std::size_t tried = 0; tried < count; ++tried) {
    const std::size_t at = turn_++ % count;
    const auto place = waiting_.begin() + static_cast<std::ptrdiff_t>(at);
    Download& download = *place;
    if (!has_answer(download, session)) continue;
    if (auto refusal = refusal_of(download)) {
      waiting_.erase(place);
      return std::move(*refusal);
    }
    if (!download.stream) {
      download.stream = connection.open_download();
      download.moved_ns = now_ns;
    }
    if (!download.stream || !connection.takes_more(*download.stream)) continue;
    auto data = take_piece(download, now_ns);
    // One bucket bounds all downloads of the session, so the other streams would get nothing either.
    if (!data) return std::nullopt;
    download.moved_ns = now_ns;
    Piece piece{*download.stream, std::move(*data), is_done(download)};
    if (piece.is_last) waiting_.erase(place);
    check_invariants();
    return piece;
  }
  return std::nullopt;
}

bool Downloads::on_read(const wire::GroomHash& groom, std::shared_ptr<const std::vector<std::uint8_t>> bytes) {
  const auto found =
      std::ranges::find_if(waiting_, [&](const Download& d) { return d.hash == groom && d.is_fetching; });
  if (found == waiting_.end()) return false;
  found->is_fetching = false;
  // The error of a vanished file is not sent here: next() sends it when the download's turn comes, which keeps the
  // order.
  found->is_gone = bytes == nullptr;
  found->bytes = std::move(bytes);
  check_invariants();
  return true;
}

void Downloads::on_stopped(DownloadStream stream) {
  counters_->downloads_given_up_stopped.add(
      std::erase_if(waiting_, [&](const Download& d) { return d.stream == stream; }));
}

std::optional<wire::Error> Downloads::give_up_stalled(Connection& connection, std::int64_t now_ns) {
  const auto found = std::ranges::find_if(waiting_, [&](const Download& d) {
    // A peer that opens streams and reads nothing would pin the files in memory: each download shares the groom's
    // bytes.
    return d.stream && !connection.takes_more(*d.stream) && now_ns - d.moved_ns > limits_->download_stalled_ns;
  });
  if (found == waiting_.end()) return std::nullopt;
  connection.reset_download(*found->stream);
  counters_->downloads_given_up_stalled.add();
  wire::Error error{ErrorReason::groom_unavailable, 0, found->hash, "its download was not read for too long"};
  waiting_.erase(found);
  return error;
}

}  // namespace hairnet::server
